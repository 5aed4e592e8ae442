// Rapier 2D: rigid bodies, revolute and prismatic joints; the hole is a polyline.
import RAPIER from "@dimforge/rapier2d-compat";
import { read, ring, run } from "./shared.mjs";

const [problem, setting] = read();
const careful = setting === "careful";
await RAPIER.init();
const world = new RAPIER.World({ x: problem.gravity[0], y: problem.gravity[1] });
if (careful) {
  world.numSolverIterations = 50;
  world.integrationParameters.lengthUnit = 0.01;
}
const bodies = problem.bodies.map((given) => {
  const [x, y, angle] = given.pose;
  const wanted = RAPIER.RigidBodyDesc.dynamic().setTranslation(x, y).setRotation(angle).setLinvel(given.rate[0], given.rate[1])
    .setAngvel(given.rate[2]).setCanSleep(false).setCcdEnabled(careful)
    .setAdditionalMassProperties(given.mass, { x: 0, y: 0 }, given.inertia || 1.0);
  return world.createRigidBody(wanted);
});
const ground = world.createRigidBody(RAPIER.RigidBodyDesc.fixed());
const pick = (k) => (k < 0 ? ground : bodies[k]);
const point = ([x, y]) => ({ x, y });
for (const [a, place, b, other] of problem.pins)
  world.createImpulseJoint(RAPIER.JointData.revolute(point(place), point(other)), pick(a), pick(b), true);
for (const [k, turn] of problem.slides) {
  const [x, y] = problem.bodies[k].pose;
  const joint = RAPIER.JointData.prismatic({ x, y }, { x: 0, y: 0 }, { x: Math.cos(turn), y: Math.sin(turn) });
  world.createImpulseJoint(joint, ground, bodies[k], true);
}
if (problem.hole) {
  const { hole } = problem;
  const corners = ring(hole);
  const shape = RAPIER.ColliderDesc.polyline(new Float32Array([...corners, corners[0]].flat()));
  const touch = (desc) => desc.setFriction(0).setRestitution(hole.restitution).setDensity(0);
  world.createCollider(touch(shape), bodies[0]);
  world.createCollider(touch(RAPIER.ColliderDesc.ball(hole.pin)), ground);
}
const advance = (count, step) => { world.timestep = step; for (let k = 0; k < count; k++) world.step(); };
run(problem, careful ? 1e-4 : 1 / 60, advance, () => bodies.map((b) => [b.translation().x, b.translation().y,
  b.rotation(), b.linvel().x, b.linvel().y, b.angvel()]));
