import { expect, it } from "vitest";
import { readDay } from "./readDay";

it.each([
  ["2026-11-05", "2026-11-05"],
  ["２０２６/11/5", "2026-11-05"],
  ["20261105", "2026-11-05"],
  ["2026年11月5日", "2026-11-05"],
  // Copied from the page, where no line breaks within a date.
  ["2026\u2060年\u206011\u2060月\u20605\u2060日", "2026-11-05"],
  ["令和8年11月5日", "2026-11-05"],
  ["令和元年5月1日", "2019-05-01"],
  ["S43.4.12", "1968-04-12"],
  ["5 Nov 2026", "2026-11-05"],
  ["Nov 5, 2026", "2026-11-05"],
  ["5 November 2026", "2026-11-05"],
  // The tests run with American English.
  ["11/5/2026", "2026-11-05"],
])("reads %s", (typed, day) => expect(readDay(typed)).toEqual({ day }));

it.each([
  ["2026-02-30", "noSuchDay"],
  ["13/13/2026", "noSuchDay"],
  ["2026-11", "unreadable"],
  ["昭和65年1月1日", "unreadable"],
  ["5 Nix 2026", "unreadable"],
  ["K-0042", "unreadable"],
  ["tomorrow", "unreadable"],
])("says why %s is no day", (typed, problem) => expect(readDay(typed)).toEqual({ problem }));
