import type { Recording } from "../api/client";

type Fixture = Recording["fixtures"][number];

export const FIXTURES: Record<Fixture, string> = {
  arm_fixer_1: "arm fixer 1",
  arm_fixer_2: "arm fixer 2",
  elbow_fixer_1: "elbow fixer 1",
  elbow_fixer_2: "elbow fixer 2",
};
