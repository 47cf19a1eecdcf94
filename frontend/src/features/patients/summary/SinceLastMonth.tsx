import { Text, Title } from "@mantine/core";
import { IconArrowDown, IconArrowRight, IconArrowUp } from "@tabler/icons-react";
import type { Schemas } from "../../../lib/api/client";
import { formatChange, formatDayOf, formatMeasured, formatSide } from "../../../lib/format";
import { t } from "../../../lib/i18n";
import { Metric, Metrics } from "../../../ui/Metric";
import { rateSpadiChange } from "../../assessments/describeFindings";
import { formatScore } from "../../assessments/messages";
import { angleChange, type Change, type Compared, painChange, spadiChange } from "./sinceLastMonth";

/** The motions that say most about a frozen shoulder, in the order of the form. */
const MOTIONS = ["flexion ", "abduction ", "external_rotation at_side"];

/** Shows the newest values and whether they are better than last month's. */
export function SinceLastMonth(props: {
  compared: Compared;
  side: "left" | "right";
  form: Schemas["AssessmentForm"];
}) {
  const { compared, side, form } = props;
  const { newest, before } = compared;
  const pain = painChange(compared);
  const spadi = spadiChange(compared);
  const title = t("patients:summary.better");
  return (
    <div data-testid="since-last-month">
      <Title order={2} size="h4">
        {title}
      </Title>
      <Text size="sm" c="dimmed" mb={6}>
        {before
          ? t("patients:summary.comparedDays", {
              newest: formatDayOf(newest.assessed_at),
              before: formatDayOf(before.assessed_at),
            })
          : t("patients:summary.onlyOne", { newest: formatDayOf(newest.assessed_at) })}
      </Text>
      <Metrics label={title}>
        {form.rom
          .filter(({ motion, position }) => MOTIONS.includes(`${motion} ${position}`))
          .map((measure) => {
            const angle = angleChange(compared, side, measure);
            return (
              angle && (
                <Metric
                  key={measure.motion}
                  label={t("patients:summary.active", {
                    motion: describeMotion(measure),
                    side: formatSide(side),
                  })}
                  value={`${formatMeasured(angle.value)}°`}
                  note={<ChangeWords of={angle} words={(change) => `${change}°`} />}
                />
              )
            );
          })}
        {pain && (
          <Metric
            label={t(`patients:summary.pains.${pain.name}`)}
            value={formatMeasured(pain.value)}
            unit={t("patients:summary.of10")}
            note={<ChangeWords of={pain} words={describePoint} />}
          />
        )}
        {spadi && (
          <Metric
            label={t("patients:summary.spadi")}
            value={formatScore(spadi.value)}
            unit={t("patients:summary.of100")}
            note={
              <>
                <ChangeWords of={spadi} words={describePoint} />{" "}
                {spadi.change !== null && <div>{rateSpadiChange(spadi.change, form)}</div>}
              </>
            }
          />
        )}
      </Metrics>
    </div>
  );
}

/** Return the short name of a motion. */
export const describeMotion = ({ motion }: Pick<Schemas["RomMeasure"], "motion">) =>
  t(`patients:summary.motions.${motion}`);

/** Return the change of a score with its unit. */
const describePoint = (change: string, count: number) => t("patients:summary.points", { change, count });

/** Shows the change with an arrow in the direction of the number. `words` adds the unit. */
function ChangeWords(props: { of: Change; words: (change: string, size: number) => string }) {
  const { change } = props.of;
  if (change === null) return null;
  const Icon = change > 0 ? IconArrowUp : change < 0 ? IconArrowDown : IconArrowRight;
  const words =
    change === 0 ? t("patients:summary.unchanged") : props.words(formatChange(change), Math.abs(change));
  return (
    <Text span fw={700} size="sm" style={{ whiteSpace: "nowrap" }}>
      <Icon size={16} style={{ verticalAlign: "text-bottom" }} aria-hidden /> {words}
    </Text>
  );
}
