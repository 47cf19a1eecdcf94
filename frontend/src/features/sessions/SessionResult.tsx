import { Group, Text } from "@mantine/core";
import {
  IconCircleCheck,
  IconCircleMinus,
  IconHandStop,
  IconHourglass,
  IconPlugConnectedX,
  IconProgress,
} from "@tabler/icons-react";
import type { Session } from "../../lib/api/client";
import { formatDeg, formatError, formatRange } from "../../lib/format";
import { t } from "../../lib/i18n";
import { translateServerText } from "../../lib/serverText";
import { Metric, Metrics } from "../../ui/Metric";
import {
  longestEndRange,
  total,
  type VerdictName,
  verdictOf,
  widestRange,
  worstError,
} from "./sessionResult";

const ICONS: Record<VerdictName, typeof IconCircleCheck> = {
  none: IconCircleMinus,
  open: IconHourglass,
  completed: IconCircleCheck,
  shortened: IconProgress,
  stopped: IconHandStop,
  interrupted: IconPlugConnectedX,
};

/** Shows whether the session went well, with the cause of every stop. */
export function Verdict({ session }: { session: Session }) {
  const verdict = verdictOf(session);
  const Icon = ICONS[verdict];
  const stops = session.runs.flatMap(({ stop }) =>
    stop ? [translateServerText(stop.message, stop.message_key)] : [],
  );
  return (
    <Group gap="xs" wrap="nowrap" align="start" data-testid="verdict" data-verdict={verdict}>
      <Icon size={26} aria-hidden style={{ flex: "none" }} />
      <div>
        <Text component="div" fw={700} size="lg">
          {t(`sessions:result.verdicts.${verdict}`)}
        </Text>
        {[...new Set(stops)].map((cause) => (
          <Text component="div" key={cause}>
            {cause}
          </Text>
        ))}
      </div>
    </Group>
  );
}

/** Pain, range, worst error, resistance and repetitions of a session. */
export function ResultMetrics({ session }: { session: Session }) {
  const { runs } = session;
  const worst = worstError(runs);
  const widest = widestRange(session);
  const endRange = longestEndRange(session);
  const shoulder = describeShoulder(session.side);
  const reversals = total(runs, (run) => run.reversals);
  // Tests of the end-feel and stretches play no recording.
  const played = runs.filter((run) => !run.end_feel);
  const done = total(played, (run) => run.repetitions_done);
  const planned = played.reduce((sum, run) => sum + run.repetitions, 0);
  return (
    <Metrics label={t("sessions:result.title")}>
      <Metric
        label={t("sessions:result.pain")}
        value={`${formatDeg(session.pain_before, 0)} → ${formatDeg(session.pain_after, 0)}`}
        unit={t("sessions:result.of10")}
        note={painNote(session)}
        testid="result-pain"
      />
      <Metric
        label={t("sessions:result.range")}
        value={widest ? describeRange(widest.reached) : "–"}
        testid="result-range"
        wide
        note={
          widest && (
            <>
              {t("sessions:result.rangeOf", {
                shoulder,
                motion: translateServerText(widest.motion.name, widest.motion.name_key),
                requested: describeRange(widest.requested),
                patient: widest.patient ?? t("sessions:goniometer.unknown"),
              })}
              <div>{t("sessions:result.slip")}</div>
            </>
          )
        }
      />
      <Metric
        label={t("sessions:result.worst")}
        value={worst ? `${formatError(Math.abs(worst.peak_deg))}°` : "–"}
        note={worst && t("sessions:result.worstOf", { motor: worst.motor, number: worst.runIndex + 1 })}
        testid="result-worst"
      />
      {endRange && (
        <Metric
          label={t("sessions:result.endRange")}
          value={formatDeg(endRange.total_s, 1)}
          unit={t("sessions:result.seconds")}
          note={t("sessions:result.endRangeOf", {
            shoulder,
            motion: translateServerText(endRange.motion.name, endRange.motion.name_key),
            band: endRange.band_deg,
            torque: endRange.torque_nm,
          })}
          testid="result-end-range"
        />
      )}
      <Metric
        label={t("sessions:result.resistance")}
        value={formatDeg(reversals, 0)}
        {...(reversals !== null && {
          unit: t("sessions:result.times", { count: reversals }),
          note: t(reversals > 0 ? "sessions:result.resistanceNote" : "sessions:result.noResistance"),
        })}
      />
      <Metric
        label={t("sessions:result.repetitions")}
        value={t("sessions:result.ofPlanned", { done: formatDeg(done, 0), planned })}
        unit={t("sessions:result.repetitionsUnit", { count: planned })}
      />
    </Metrics>
  );
}

/** Return "Left shoulder", or that the shoulder is not known. */
export const describeShoulder = (side: Session["side"]) =>
  side === null ? t("sessions:facts.unknownShoulder") : t(`sessions:facts.shoulder.${side}`);

const describeRange = ([from, to]: [number, number]) => `${formatRange(from, to)}°`;

function painNote({ pain_before, pain_during, pain_after }: Session): string {
  const during = pain_during === null ? "" : t("sessions:result.during", { pain: pain_during });
  if (pain_before === null || pain_after === null) return during;
  const change = pain_after - pain_before;
  const words =
    change === 0
      ? t("sessions:result.unchanged")
      : t(change < 0 ? "sessions:result.less" : "sessions:result.more", { count: Math.abs(change) });
  return during ? t("sessions:result.both", { change: words, during }) : words;
}
