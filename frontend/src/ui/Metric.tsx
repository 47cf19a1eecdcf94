import { Skeleton, Text } from "@mantine/core";
import { createLink } from "@tanstack/react-router";
import { type ComponentPropsWithoutRef, forwardRef, type ReactNode } from "react";
import { t } from "../lib/i18n";
import classes from "./ui.module.css";

/** A longer value, such as a range of angles, has smaller letters in a narrow tile. Japanese characters count twice. */
const LONG = 10;
/** A value of so many characters, such as −7.2 to 70.3°, fits on one line of a narrow tile. */
const LONGEST_LINE = 13;

const lengthOf = (text: string) =>
  [...text].reduce((sum, character) => sum + (character >= "\u2e80" ? 2 : 1), 0);

interface KeyFigure {
  label: string;
  /** Undefined while the value loads. */
  value: string | undefined;
  /** Unit or scale of the value. In every language it follows the value. */
  unit?: string;
  note?: ReactNode;
  /** True if the figure needs attention. */
  needsAttention?: boolean;
  failed?: boolean;
}

/** One number with its name, its unit, and what it means or how it changed. `wide`: where there is room, it is as wide as two. */
export function Metric({ testid, wide, ...figure }: KeyFigure & { testid?: string; wide?: true }) {
  return (
    <div className={classes.metric} data-testid={testid} data-wide={wide}>
      <Content {...figure} />
    </div>
  );
}

/** A key figure that links to the page behind it. It keeps its size while it loads. */
export const MetricLink = createLink(
  forwardRef<HTMLAnchorElement, KeyFigure & ComponentPropsWithoutRef<"a">>(
    ({ label, value, unit, note, needsAttention, failed, ...link }, ref) => (
      <a ref={ref} {...link} className={`${classes.metric} ${classes.leads}`} data-attention={needsAttention}>
        <Content
          {...{ label, value, note }}
          {...(unit && { unit })}
          {...(needsAttention && { needsAttention })}
          {...(failed && { failed })}
        />
      </a>
    ),
  ),
);

function Content({ label, value, unit, note, needsAttention, failed }: KeyFigure) {
  const shown = failed ? t("ui:metric.unavailable") : value;
  return (
    <>
      <Text component="div" size="sm" c="dimmed">
        {label}
      </Text>
      {shown === undefined ? (
        <Skeleton h={32} my={4} w="60%" />
      ) : (
        <Text
          component="div"
          className={classes.value ?? ""}
          data-long={lengthOf(shown) > LONG}
          {...(needsAttention && { c: "grape" })}
        >
          {/* In a narrow tile the line breaks before the unit, not within the value. */}
          <span style={{ whiteSpace: lengthOf(shown) <= LONGEST_LINE ? "nowrap" : "normal" }}>{shown}</span>
          {unit && shown === value && (
            <>
              {" "}
              <span className={classes.unit}>{unit}</span>
            </>
          )}
        </Text>
      )}
      {note && (
        <Text component="div" size="sm">
          {note}
        </Text>
      )}
    </>
  );
}

/** Several numbers side by side, as many as fit. */
export function Metrics({ label, children }: { label: string; children: ReactNode }) {
  return (
    <section className={classes.metricsFrame} aria-label={label}>
      <div className={classes.metrics}>{children}</div>
    </section>
  );
}
