import { beforeEach, describe, expect, it, vi } from "vitest";
import said from "./told.ja.json";

beforeEach(() => {
  vi.resetModules();
  localStorage.clear();
});

async function speaking(language: "en" | "ja") {
  localStorage.setItem("kata.language", language);
  const { learn, told } = await import("./told");
  await learn();
  return told;
}

describe("what the service says", () => {
  it.each([
    ["The emergency stop was pressed.", "非常停止が押されました。"],
    ["Motor 3 does not answer.", "モータ3が応答しません。"],
    // A value is a word of ours, a sentence in a list, or somebody's name.
    [
      "This is for the left shoulder, and the apparatus stands for the right one.",
      "これは左肩用ですが、装置は右肩用の向きです。",
    ],
    [
      "Not everything is in order yet: The foot pedal answers; The belt holds the patient in the seat.",
      "まだ確認が済んでいません：フットペダルが反応する、ベルトで患者が座席に固定されている。",
    ],
    [
      "This cannot be played so: motor 4 would jerk at 3.1 s.",
      "この方法では再生できません：モータ4の動きが3.1秒の時点で急変します。",
    ],
    ["山田 花子 is archived.", "山田 花子はアーカイブ済みです。"],
    ["The hand is still guiding the arm.", "手がまだ腕を導いています。"],
    ["Nobody has ever said this.", "Nobody has ever said this."],
    ["", ""],
  ])("as %s", async (english, japanese) => {
    const told = await speaking("ja");
    expect(told(english)).toBe(japanese);
  });

  it("stays as it is on an English page", async () => {
    const told = await speaking("en");
    for (const english of Object.keys(said)) expect(told(english)).toBe(english);
  });

  it("has in Japanese only values that it has in English", () => {
    const places = (text: string) => new Set(text.match(/\{\d\}/g) ?? []);
    for (const [english, japanese] of Object.entries(said))
      expect(
        [...places(japanese)].filter((place) => !places(english).has(place)),
        english,
      ).toEqual([]);
  });
});
