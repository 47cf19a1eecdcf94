import { say } from "../../lib/language";

export const REPORT = say(
  {
    title: "Report",
    print: "Report to print",
    pdf: "Report as PDF",
    language: "Language of the report",
  },
  {
    title: "報告書",
    print: "報告書を印刷",
    pdf: "報告書（PDF）",
    language: "報告書の言語",
  },
);
