import { Text } from "@mantine/core";
import type { Schemas } from "../../lib/api/client";
import classes from "./patientMode.module.css";

/** The answers of one question as large buttons. Pressing the chosen answer again clears it. */
export function AnswerButtons(props: {
  question: Schemas["PatientQuestion"];
  language: string;
  value: number | null;
  onChange: (value: number | null) => void;
}) {
  const { question, language, value, onChange } = props;
  const { options } = question;
  const worded = options.every(({ label }) => label);
  const ends = worded ? [] : [options[0]?.label, options.at(-1)?.label].filter((label) => label);
  return (
    <div>
      <div
        role="radiogroup"
        aria-label={question.text}
        lang={language}
        className={`${classes.answers} ${worded ? classes.worded : ""}`}
      >
        {options.map(({ answer, label }) => (
          // biome-ignore lint/a11y/useSemanticElements: a large button, because a radio input cannot be cleared.
          <button
            key={answer}
            type="button"
            role="radio"
            aria-checked={value === answer}
            className={classes.answer}
            {...(!worded && label && { "aria-label": `${answer}: ${label}` })}
            onClick={() => onChange(value === answer ? null : answer)}
          >
            {worded ? label : answer}
          </button>
        ))}
      </div>
      {ends.length > 0 && (
        <div className={classes.ends} lang={language}>
          {ends.map((label) => (
            <Text key={label} fz={20}>
              {label}
            </Text>
          ))}
        </div>
      )}
    </div>
  );
}
