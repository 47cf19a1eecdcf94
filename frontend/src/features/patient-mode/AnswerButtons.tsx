import { Text } from "@mantine/core";
import type { Schemas } from "../../lib/api/client";
import classes from "./patientMode.module.css";

const describeAnswer = ({ answer, label }: Schemas["AnswerOption"]) => `${answer}: ${label}`;

/** So many answers of 44 px fit in a row on a telephone. */
const MOST_IN_ONE_ROW = 7;

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
  const ends = worded ? [] : [options[0], options.at(-1)].flatMap((end) => (end?.label ? [end] : []));
  const layout = worded ? classes.worded : options.length > MOST_IN_ONE_ROW ? classes.long : "";
  return (
    <div className={classes.scale ?? ""}>
      <div
        role="radiogroup"
        aria-label={question.text}
        lang={language}
        className={`${classes.answers} ${layout}`}
      >
        {options.map(({ answer, label }) => (
          // biome-ignore lint/a11y/useSemanticElements: a large button, because a radio input cannot be cleared.
          <button
            key={answer}
            type="button"
            role="radio"
            aria-checked={value === answer}
            className={classes.answer}
            {...(!worded && label && { "aria-label": describeAnswer({ answer, label }) })}
            onClick={() => onChange(value === answer ? null : answer)}
          >
            {worded ? label : answer}
          </button>
        ))}
      </div>
      {ends.length > 0 && (
        <div className={classes.ends} lang={language}>
          {ends.map((end) => (
            <Text key={end.answer} fz={20}>
              {describeAnswer(end)}
            </Text>
          ))}
        </div>
      )}
    </div>
  );
}
