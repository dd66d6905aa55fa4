import { join } from "node:path";
import { expect, inject, test } from "vitest";
import { contact, motor } from "../src/stuck_card";
import { Core } from "../src/core";
import { coreOf, descriptionOf, expected } from "./browser";

const directory = inject("directory");

test.each(["drive", "worm", "axis"])(
  "what holds each contact of the %s is what Python says, to the last bit",
  async (name) => {
    const file = join(directory, `${name}.html`);
    const core = await Core.load(coreOf(file));
    const { core: input } = descriptionOf(file);
    for (const { time, contacts, motors } of expected(directory, name).explained) {
      const found = core.explain(input, time);
      expect(
        found.contacts.map((c) => [c.name, c.mode, c.speed, c.torque, c.forward, c.backward]),
        `${time} s`,
      ).toEqual(contacts);
      expect(found.motors.map((m) => [m.name, m.forward, m.backward])).toEqual(motors);
    }
  },
);

test("a contact is told in words", () => {
  const held = { name: "load", mode: 0, speed: 0, torque: 0.25, forward: 1, backward: 2 };
  expect(contact(held)).toBe(
    "stuck, holds 250 mN·m of +1 N·m / −2 N·m; 750 mN·m more frees it forward, 2.25 N·m backward",
  );
  expect(contact({ ...held, mode: -1, speed: -3, torque: -1 })).toBe("slips backward at −3 rad/s and takes 1 N·m");
  expect(contact({ ...held, forward: Infinity, backward: Infinity })).toBe("rigid, holds 250 mN·m");
  expect(motor({ name: "m", forward: 0.125, backward: -Infinity }, undefined)).toBe(
    "From rest it moves forward with a constant command above 0.125, backward at no command.",
  );
});
