import { afterEach, describe, expect, it } from "vitest";
import english from "../../server-messages.json";
import japanese from "../locales/ja/server.json";
import { loadServerTexts, translatePlaced, translateServerText } from "./serverText";

afterEach(() => loadServerTexts("en"));

const nested = (code: string, text: string, params = {}) => ({ code, text, params });

describe("a server text on a Japanese page", () => {
  it.each([
    ["The emergency stop was pressed.", { code: "estop_pressed", params: {} }, "非常停止が押されました。"],
    [
      "Motor 3 does not answer.",
      { code: "drive_silent", params: { motor: 3 } },
      "モータ\u20603が応答しません。",
    ],
    [
      "This is for the left shoulder, but the apparatus is set to the right one.",
      {
        code: "other_side",
        params: { wanted: nested("side_left", "left"), stands_for: nested("side_right", "right") },
      },
      "これは左肩用ですが、装置は右肩用の向きです。",
    ],
    [
      "These checks are not complete yet: The foot pedal answers; The belt holds the patient in the seat.",
      {
        code: "checks_open",
        params: {
          checks: [
            nested("check_pedal", "The foot pedal answers."),
            nested("check_belt", "The belt holds the patient in the seat."),
          ],
        },
      },
      "次の確認がまだ済んでいません：フットペダルが反応する、ベルトで患者が座席に固定されている。",
    ],
    [
      "This method cannot play the recording: motor 4 would jerk at 3.1 s.",
      {
        code: "method_not_playable",
        params: {
          reason: nested("motor_would_jerk", "motor 4 would jerk at 3.1 s", { motor: 4, at_s: 3.0999 }),
        },
      },
      "この方法では再生できません：モータ\u20604の動きが3.1秒の時点で急変します。",
    ],
    [
      "Abduction is archived.",
      { code: "patient_archived", params: { patient: "Abduction" } },
      "Abductionはアーカイブ済みです。",
    ],
    [
      "line 3, column after time_s",
      {
        code: "line_and_column",
        params: { line: 3, column: nested("column_after", "after time_s", { column: "time_s" }) },
      },
      "3行目、time_sより右の列",
    ],
    [
      "line 3, column time_s",
      { code: "line_and_column", params: { line: 3, column: nested("", "time_s") } },
      "3行目、time_s列",
    ],
    ["mirrored long ago", null, "mirrored long ago"],
    ["Of a newer service.", { code: "newer", params: {} }, "Of a newer service."],
    [
      "A motor cannot be set up: E17.",
      { code: "motor_cannot_be_set_up", params: { reason: nested("", "E17") } },
      "モータを設定できません：E17。",
    ],
  ])("translates %s by its code", async (text, key, translation) => {
    await loadServerTexts("ja");
    expect(translateServerText(text, key)).toBe(translation);
  });

  it("is translated inside a figure, and user texts are not", async () => {
    await loadServerTexts("ja");
    const figure = {
      data: [{ name: "Requested", hovertemplate: "%{y:.2f}°" }, { name: "Abduction" }],
      layout: { xaxis: { title: { text: "Time, s" } } },
      texts: [
        { code: "figure_requested", params: {}, places: ["/data/0/name"] },
        { code: "figure_angle_hover", params: {}, places: ["/data/0/hovertemplate"] },
        { code: "figure_time", params: {}, places: ["/layout/xaxis/title/text", "/layout/yaxis/title/text"] },
      ],
    };
    expect(translatePlaced(figure)).toEqual({
      data: [{ name: "要求", hovertemplate: "%{y:.2f}°" }, { name: "Abduction" }],
      layout: { xaxis: { title: { text: "時間（秒）" } } },
      texts: figure.texts,
    });
    expect(figure.data[0]?.name).toBe("Requested");
  });
});

it("stays English on an English page", async () => {
  await loadServerTexts("en");
  expect(translateServerText("Try again.", { code: "try_again", params: {} })).toBe("Try again.");
  const table = {
    rows: [["active"]],
    texts: [{ code: "figure_kind_active", params: {}, places: ["/rows/0/0"] }],
  };
  expect(translatePlaced(table)).toBe(table);
});

it("has a Japanese translation of every message, and no other", () => {
  expect(Object.keys(japanese)).toEqual(Object.keys(english));
});
