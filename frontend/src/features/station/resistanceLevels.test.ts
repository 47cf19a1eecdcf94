import { expect, it } from "vitest";
import openapi from "../../../openapi.json";
import { firstResistanceLevel, RESISTANCE_LEVELS } from "./resistanceLevels";

it("offers as many levels as the service accepts", () => {
  expect(openapi.components.schemas.LoadRequest.properties.resistance_level.maximum).toBe(RESISTANCE_LEVELS);
});

it("offers the last level up to the doctor's limit", () => {
  expect(firstResistanceLevel(null, null)).toBeNull();
  expect(firstResistanceLevel(7, null)).toBe(7);
  expect(firstResistanceLevel(null, 12)).toBeNull();
  expect(firstResistanceLevel(20, 12)).toBe(12);
  expect(firstResistanceLevel(7, 12)).toBe(7);
});
