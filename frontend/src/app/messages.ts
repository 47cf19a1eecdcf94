import { say } from "../lib/language";

/** Where there is no page, or one that fails. */
export const NO_PAGE = say(
  {
    none: "There is no such page",
    old: (link: string) => `The address may be old. ${link}`,
    toStation: "Go to the station.",
    broken: "This page cannot be shown",
    wrong: "Something went wrong in it. Reload it; the apparatus goes on as it was.",
  },
  {
    none: "ページがありません",
    old: (link) => `アドレスが古い可能性があります。${link}`,
    toStation: "ステーションへ移動",
    broken: "このページを表示できません",
    wrong: "ページで問題が起きました。再読み込みしてください。装置はそのまま動作を続けています。",
  },
);
