// Read a problem and print a result: used by the engines that run in Node.
import fs from "node:fs";

export const read = () => [JSON.parse(fs.readFileSync(process.argv[2], "utf8")), process.argv[3]];

export const run = (problem, step, advance, states) => {
  const samples = problem.reference.length;
  const every = Math.max(1, Math.round(problem.until / step / (samples - 1)));
  const made = [states()];
  const began = performance.now();
  for (let k = 1; k < samples; k++) {
    advance(every, problem.until / (samples - 1) / every);
    made.push(states());
  }
  console.log("\n" + JSON.stringify({ states: made, seconds: (performance.now() - began) / 1e3 }));
};

export const ring = (hole, count = 120) => {
  const radius = hole.radius / Math.cos(Math.PI / count);
  return Array.from({ length: count }, (_, k) => {
    const turn = (2 * Math.PI * k) / count;
    return [hole.place[0] + radius * Math.cos(turn), hole.place[1] + radius * Math.sin(turn)];
  });
};
