import { say } from "../lib/language";

export const FIGURE = say(
  { drawing: "The figure is being drawn", failed: "The figure could not be drawn.", again: "Try again" },
  { drawing: "グラフを描いています", failed: "グラフを描けませんでした。", again: "再試行" },
);

/** What Plotly calls its buttons. */
export const PLOTLY = say<Record<string, string>>(
  {},
  {
    "Download plot as a PNG": "PNG画像として保存",
    "Download plot": "画像として保存",
    "Share chart...": "グラフを共有…",
    "Box Select": "四角で選択",
    "Lasso Select": "囲んで選択",
    Zoom: "拡大範囲の選択",
    Pan: "移動",
    "Zoom in": "拡大",
    "Zoom out": "縮小",
    Autoscale: "全体を表示",
    "Reset axes": "軸を元に戻す",
    "Click to enter": "クリックして入力",
    "Double-click to zoom back out": "ダブルクリックで全体表示",
    "Taking snapshot - this may take a few seconds": "画像を作成しています",
    "Snapshot succeeded": "画像を保存しました",
    "Sorry, there was a problem downloading your snapshot!": "画像を保存できませんでした",
  },
);

const MONTHS = Array.from({ length: 12 }, (_, month) => `${month + 1}月`);

/** How Plotly writes a day. */
export const PLOTLY_DAYS = say<Record<string, string | string[]>>(
  {},
  { months: MONTHS, shortMonths: MONTHS, date: "%Y/%m/%d" },
);
