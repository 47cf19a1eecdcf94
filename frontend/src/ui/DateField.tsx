import { ActionIcon, TextInput, type TextInputProps } from "@mantine/core";
import { IconCalendar } from "@tabler/icons-react";
import { type KeyboardEvent, useRef, useState } from "react";
import { isDay } from "../lib/days";
import { formatDay } from "../lib/format";
import { t } from "../lib/i18n";
import { withoutJoiners } from "../lib/joinUnits";
import { readDay } from "../lib/readDay";
import classes from "./ui.module.css";

/** A day with two digits of month and day, after which no further digit is expected. */
const COMPLETE = /^\d{4}[-/]\d{2}[-/]\d{2}$/;

interface DateFieldProps extends Pick<TextInputProps, "error" | "required"> {
  label: string;
  /** A day such as 2026-11-21, an empty text, or a typed text that is no day. */
  value: string;
  /** The last possible day. */
  max?: string;
  /** Called with a value. A form sends a text that is no day to the service, which refuses it; a filter ignores it. */
  onChange: (value: string) => void;
}

/**
 * A day that the user types in a usual form, or picks from the browser's calendar. When the user has finished, the field
 * shows the day as the page's texts do, so that day and month cannot be confused. A wrong text stays, and the field shows the
 * error.
 */
export function DateField({ label, value, max, onChange, error, required = false }: DateFieldProps) {
  const calendar = useRef<HTMLInputElement>(null);
  // What is being typed; null: the value is shown.
  const [typed, setTyped] = useState<string | null>(null);
  const [problem, setProblem] = useState<string | null>(null);
  const [seen, setSeen] = useState(value);
  const [sent, setSent] = useState(value);
  if (seen !== value) {
    setSeen(value);
    if (value !== sent) {
      // Another part of the page changed the value.
      setSent(value);
      setTyped(null);
      setProblem(null);
    }
  }
  const take = (next: string, text: string | null, wrong: string | null) => {
    setTyped(text);
    setProblem(wrong);
    setSent(next);
    if (next !== value) onChange(next);
  };
  const type = (text: string) => {
    const day = text === "" ? "" : COMPLETE.test(text) ? dayOf(text, max) : null;
    if (day === null) setTyped(text);
    else take(day, text, null);
  };
  const finish = () => {
    if (typed === null) return;
    const wrong = typed.trim() === "" ? null : problemOf(typed, max);
    take(wrong ? typed : (dayOf(typed, max) ?? ""), wrong ? typed : null, wrong);
  };
  const submit = (event: KeyboardEvent) => event.key === "Enter" && finish();
  return (
    <TextInput
      label={label}
      required={required}
      placeholder={t("ui:day.placeholder")}
      maxLength={40}
      autoComplete="off"
      value={typed ?? (isDay(value) ? withoutJoiners(formatDay(value)) : value)}
      error={problem ?? error}
      onChange={(event) => type(event.currentTarget.value)}
      onBlur={finish}
      onKeyDown={submit}
      rightSectionWidth={44}
      rightSection={
        <>
          <input
            ref={calendar}
            type="date"
            className={classes.calendar ?? ""}
            tabIndex={-1}
            aria-hidden
            value={isDay(value) ? value : ""}
            max={max}
            onChange={(event) => event.currentTarget.value && take(event.currentTarget.value, null, null)}
          />
          <ActionIcon
            variant="subtle"
            size={40}
            aria-label={t("ui:day.pick", { label })}
            onClick={() => calendar.current?.showPicker()}
          >
            <IconCalendar size={20} />
          </ActionIcon>
        </>
      }
    />
  );
}

/** Return the day of a typed text, or null if it is none or too late. */
function dayOf(typed: string, max: string | undefined): string | null {
  const read = readDay(typed);
  return "day" in read && !(max && read.day > max) ? read.day : null;
}

/** Return the error of a typed text, or null. */
function problemOf(typed: string, max: string | undefined): string | null {
  const read = readDay(typed);
  if ("problem" in read) return t(`ui:day.${read.problem}`, { typed });
  return max && read.day > max ? t("ui:day.tooLate", { last: formatDay(max) }) : null;
}
