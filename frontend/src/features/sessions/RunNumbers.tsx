import { Card, Group, Stack, Table, Text } from "@mantine/core";
import type { Run } from "../../lib/api/client";
import { formatDeg, formatError, formatRange } from "../../lib/format";
import { t } from "../../lib/i18n";
import { translateServerText } from "../../lib/serverText";
import { WideTable } from "../../ui/WideTable";
import { SampleLinks } from "../import-export/SampleLinks";
import { Head, Row } from "./figureRows";
import { describePatientAngle } from "./patientAngle";
import { describeMissingComparison, RunHeading } from "./RunHeading";

/** Shows the errors of a playback by motor and by motion, with links to its samples as files. */
export function RunNumbers({ run, number }: { run: Run; number: number }) {
  return (
    <Card withBorder component="section" aria-label={t("sessions:session.playback", { number })}>
      <Stack>
        <RunHeading run={run} number={number} />
        {run.comparison ? (
          <>
            <Group justify="end">
              <SampleLinks of="runs" id={run.id} />
            </Group>
            <MotorErrors run={run} comparison={run.comparison} />
            <MotionErrors motions={run.comparison.motions} />
          </>
        ) : (
          <Text>{describeMissingComparison(run)}</Text>
        )}
      </Stack>
    </Card>
  );
}

type Comparison = NonNullable<Run["comparison"]>;

function MotorErrors({ run, comparison }: { run: Run; comparison: Comparison }) {
  return (
    <Errors
      testid="errors"
      caption={[
        run.rate_hz
          ? t("sessions:compared.captionAt", { samples: comparison.samples, hz: run.rate_hz })
          : t("sessions:compared.caption", { samples: comparison.samples }),
        ...explainTimes(run.clock_offset_s),
        t("sessions:compared.smoothness"),
      ].join(" ")}
      first={t("sessions:compared.motor")}
      heads={t("sessions:compared.motorHeads", { returnObjects: true })}
      rows={comparison.motors.map((motor) => ({
        first: t("sessions:compared.motorNumber", { motor: motor.motor }),
        compared: motor,
        others: [
          formatDeg(motor.torque_peak_nm, 2),
          formatDeg(motor.taught_smoothness, 2),
          formatDeg(motor.played_smoothness, 2),
        ],
      }))}
    />
  );
}

/**
 * Return sentences about the times of the comparison. An offset of the clock that rounds to zero is left out.
 * `clockOffset_s` is absent in the figures of an old playback.
 */
export function explainTimes(clockOffset_s: number | null | undefined): string[] {
  if (typeof clockOffset_s !== "number") return [t("sessions:compared.oldFigures")];
  const explained = t("sessions:compared.explained");
  const offset = formatDeg(clockOffset_s, 3);
  return Number(offset) === 0 ? [explained] : [explained, t("sessions:compared.clockOffset", { offset })];
}

/** Compares the patient's motion with the apparatus's range and with a healthy shoulder. */
function MotionErrors({ motions }: { motions: Comparison["motions"] }) {
  if (motions.length === 0) return null;
  return (
    <Errors
      testid="motions"
      caption={t("sessions:compared.motionsCaption")}
      first={t("sessions:compared.motion")}
      heads={t("sessions:compared.motionHeads", { returnObjects: true })}
      rows={motions.map((motion) => ({
        first: t("sessions:compared.motionNamed", {
          number: motion.motion,
          name: translateServerText(motion.name, motion.name_key),
        }),
        compared: motion,
        others: [
          describePatientAngle(motion) ?? t("sessions:goniometer.onlyApparatus"),
          formatRange(motion.apparatus_min_deg, motion.apparatus_max_deg),
          formatRange(motion.reference_min_deg, motion.reference_max_deg),
          describeEndRange(motion),
        ],
      }))}
    />
  );
}

/** Return the end-range time with the limits by which it was counted, or a dash if it was not counted. */
export function describeEndRange(motion: Comparison["motions"][number]): string {
  const { end_range_s, end_range_band_deg, end_range_torque_nm } = motion;
  const seconds = formatDeg(end_range_s ?? null, 1);
  if (end_range_s == null || end_range_band_deg == null || end_range_torque_nm == null) return seconds;
  return t("sessions:compared.endRange", {
    seconds,
    band: end_range_band_deg,
    torque: end_range_torque_nm,
  });
}

type Compared = Comparison["motors"][number] | Comparison["motions"][number];

/** A table of errors. The columns of every comparison come first, then the others. */
function Errors(props: {
  testid: string;
  caption: string;
  first: string;
  heads: string[];
  rows: { first: string; compared: Compared; others: string[] }[];
}) {
  return (
    <WideTable minWidth={1120} caption={props.caption} data-testid={props.testid}>
      <Head
        first={props.first}
        others={[...t("sessions:compared.heads", { returnObjects: true }), ...props.heads]}
      />
      <Table.Tbody>
        {props.rows.map(({ first, compared, others }) => (
          <Row key={first} first={first} others={[...errorCells(compared), ...others]} />
        ))}
      </Table.Tbody>
    </WideTable>
  );
}

function errorCells(compared: Compared): string[] {
  return [
    formatError(compared.peak_deg),
    compared.peak_at_s.toFixed(1),
    formatError(compared.rmse_deg),
    formatError(compared.start_deg),
    formatDeg(compared.lag_ms, 0),
    formatError(compared.wall_peak_deg),
    formatError(compared.wall_rmse_deg),
    formatError(compared.change_deg),
    formatRange(compared.taught_min_deg, compared.taught_max_deg),
    formatRange(compared.played_min_deg, compared.played_max_deg),
  ];
}
