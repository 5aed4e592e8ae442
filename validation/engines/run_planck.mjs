// Planck.js: rigid bodies, revolute and prismatic joints; the hole is a loop of edges.
import * as planck from "planck";
import { read, ring, run } from "./shared.mjs";

const [problem, setting] = read();
const careful = setting === "careful";
const world = new planck.World({ gravity: planck.Vec2(...problem.gravity) });
if (careful) { planck.Settings.linearSlop = 1e-6; planck.Settings.velocityThreshold = 1e-3; }
const bodies = problem.bodies.map((given) => {
  const body = world.createBody({ type: "dynamic", position: planck.Vec2(...given.pose.slice(0, 2)), angle: given.pose[2],
    linearVelocity: planck.Vec2(...given.rate.slice(0, 2)), angularVelocity: given.rate[2], allowSleep: false, bullet: careful });
  body.setMassData({ mass: given.mass, center: planck.Vec2(0, 0), I: given.inertia || 1.0 });
  return body;
});
const ground = world.createBody();
const pick = (k) => (k < 0 ? ground : bodies[k]);
for (const [a, place, b, other] of problem.pins)
  world.createJoint(new planck.RevoluteJoint({ bodyA: pick(a), bodyB: pick(b), localAnchorA: planck.Vec2(...place),
    localAnchorB: planck.Vec2(...other), referenceAngle: pick(b).getAngle() - pick(a).getAngle() }));
for (const [k, turn] of problem.slides)
  world.createJoint(new planck.PrismaticJoint({}, ground, bodies[k], bodies[k].getPosition(), planck.Vec2(Math.cos(turn), Math.sin(turn))));
if (problem.hole) {
  const { hole } = problem;
  bodies[0].createFixture({ shape: new planck.Chain(ring(hole).map((p) => planck.Vec2(...p)), true), density: 0, friction: 0,
    restitution: hole.restitution });
  bodies[0].setMassData({ mass: 1, center: planck.Vec2(0, 0), I: 1 / 12 });
  ground.createFixture({ shape: new planck.Circle(hole.pin), friction: 0, restitution: hole.restitution });
}
const advance = (count, step) => { for (let k = 0; k < count; k++) world.step(step, ...(careful ? [200, 50] : [8, 3])); };
run(problem, careful ? 1e-4 : 1 / 60, advance, () => bodies.map((b) => [b.getPosition().x, b.getPosition().y,
  b.getAngle(), b.getLinearVelocity().x, b.getLinearVelocity().y, b.getAngularVelocity()]));
