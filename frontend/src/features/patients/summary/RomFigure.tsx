import { Group, SegmentedControl, Table, Text, Title } from "@mantine/core";
import { useState } from "react";
import type { Assessment, Schemas } from "../../../lib/api/client";
import { formatMeasured, formatSide } from "../../../lib/format";
import { t } from "../../../lib/i18n";
import { SaveTableButton } from "../../../ui/CsvButton";
import { KINDS, type Kind, type Side } from "../../assessments/draft";
import { EDGE, type RomRow, radarPoint, romRows } from "./romRadar";
import { describeMotion } from "./SinceLastMonth";
import classes from "./summary.module.css";

const [WIDTH, HEIGHT, RADIUS] = [340, 240, 98];
/** Minimum number of motions for the radar figure, because an area needs at least three points. */
const FEWEST = 3;

/**
 * Shows the range of motion of both shoulders: shares of the reference as a radar figure, and the angles as a
 * table.
 */
export function RomFigure(props: {
  form: Schemas["AssessmentForm"];
  newest: Assessment;
  baseline: Assessment | null;
  affected: Side;
}) {
  const { form, newest, baseline, affected } = props;
  const [chosen, setChosen] = useState<Kind | null>(null);
  const ofKind = (kind: Kind) => romRows(form.rom, newest, baseline, affected, kind);
  const measured = KINDS.filter((kind) => ofKind(kind).length > 0);
  const kind = chosen ?? measured[0] ?? "active";
  const rows = ofKind(kind);
  return (
    <section aria-label={t("patients:summary.rom")} data-testid="rom-figure">
      <Group justify="space-between" mb="xs">
        <Title order={2} size="h4">
          {t("patients:summary.rom")}
        </Title>
        {measured.length > 1 && (
          <SegmentedControl
            size="sm"
            aria-label={t("patients:summary.kind")}
            value={kind}
            onChange={(value) => setChosen(value as Kind)}
            data={measured.map((value) => ({ value, label: t(`assessments:kinds.${value}`) }))}
          />
        )}
      </Group>
      {rows.length === 0 && <Text>{t("patients:summary.noRom")}</Text>}
      {rows.length > 0 && (
        <div className={classes.rom}>
          {rows.length >= FEWEST && <Radar rows={rows} affected={affected} />}
          <RomTable rows={rows} affected={affected} />
        </div>
      )}
      {rows.length > 0 && <SaveTableButton name="range-of-motion" table={savedTable(rows, affected)} />}
    </section>
  );
}

/** Return the shown angles in degrees, for a file. */
function savedTable(rows: RomRow[], affected: Side): Schemas["ProgressTable"] {
  const heads = [
    t("patients:summary.motion"),
    t("patients:summary.affected", { side: formatSide(affected) }),
    t("patients:summary.first"),
    formatSide(affected === "left" ? "right" : "left"),
    t("patients:summary.reference"),
  ];
  return {
    columns: heads.map((head, place) => ({ name: place ? `${head} (°)` : head, kind: "text", digits: 0 })),
    rows: rows.map((row) => [
      describeMotion(row.measure),
      row.affected,
      row.first,
      row.other,
      row.measure.reference_deg,
    ]),
    texts: [],
  };
}

function RomTable({ rows, affected }: { rows: RomRow[]; affected: Side }) {
  const other = affected === "left" ? "right" : "left";
  return (
    <Table verticalSpacing={4} horizontalSpacing={6} fz="sm" aria-label={t("patients:summary.rom")}>
      <Table.Thead>
        <Table.Tr>
          <Table.Th>{t("patients:summary.motion")}</Table.Th>
          <Table.Th ta="right">{t("patients:summary.affected", { side: formatSide(affected) })}</Table.Th>
          <Table.Th ta="right">{t("patients:summary.first")}</Table.Th>
          <Table.Th ta="right">{formatSide(other)}</Table.Th>
          <Table.Th ta="right">{t("patients:summary.reference")}</Table.Th>
        </Table.Tr>
      </Table.Thead>
      <Table.Tbody>
        {rows.map((row) => (
          <Table.Tr key={row.measure.motion}>
            <Table.Td>{describeMotion(row.measure)}</Table.Td>
            <Table.Td ta="right" fw={700}>
              {describeAngle(row.affected)}
            </Table.Td>
            <Table.Td ta="right">{describeAngle(row.first)}</Table.Td>
            <Table.Td ta="right">{describeAngle(row.other)}</Table.Td>
            <Table.Td ta="right">{describeAngle(row.measure.reference_deg)}</Table.Td>
          </Table.Tr>
        ))}
      </Table.Tbody>
    </Table>
  );
}

const describeAngle = (angle: number | null) => (angle === null ? "–" : `${formatMeasured(angle)}°`);

/** The radar figure. It repeats the table beside it, so it is hidden from screen readers. */
function Radar({ rows, affected }: { rows: RomRow[]; affected: Side }) {
  const other = affected === "left" ? "right" : "left";
  const point = (row: RomRow, n: number, angle: number) =>
    radarPoint(angle, row.measure.reference_deg, n, rows.length, RADIUS);
  const shape = (of: (row: RomRow) => number | null) =>
    rows.map((row, n) => point(row, n, of(row) ?? 0).join()).join(" ");
  const whole = (of: (row: RomRow) => number | null) => rows.every((row) => of(row) !== null);
  return (
    <figure className={classes.radar} aria-hidden>
      <svg
        aria-hidden
        viewBox={`${-WIDTH / 2} ${-HEIGHT / 2} ${WIDTH} ${HEIGHT}`}
        width={WIDTH}
        height={HEIGHT}
      >
        {[0.25, 0.5, 0.75, 1].map((share) => (
          <polygon
            key={share}
            className={share === 1 ? classes.reference : classes.ring}
            points={shape((row) => share * row.measure.reference_deg)}
          />
        ))}
        {rows.map((row, n) => {
          const [x, y] = point(row, n, EDGE * row.measure.reference_deg);
          return <line key={row.measure.motion} className={classes.ring} x2={x} y2={y} />;
        })}
        {whole((row) => row.other) && (
          <polygon className={classes.other} points={shape((row) => row.other)} />
        )}
        {whole((row) => row.first) && (
          <polygon className={classes.first} points={shape((row) => row.first)} />
        )}
        {whole((row) => row.affected) && (
          <polygon className={classes.now} points={shape((row) => row.affected)} />
        )}
        {rows.map((row, n) => {
          const [x, y] = point(row, n, EDGE * row.measure.reference_deg);
          return (
            <SpokeName
              key={row.measure.motion}
              words={describeMotion(row.measure)}
              x={1.06 * x}
              y={1.1 * y}
            />
          );
        })}
      </svg>
      <figcaption className={classes.keys}>
        <span className={classes.nowKey}>{t("patients:summary.nowKey", { side: formatSide(affected) })}</span>
        <span className={classes.firstKey}>{t("patients:summary.firstKey")}</span>
        <span className={classes.otherKey}>{formatSide(other)}</span>
        <span className={classes.referenceKey}>{t("patients:summary.reference")}</span>
      </figcaption>
    </figure>
  );
}

/** Shows the name at the end of a spoke, one word per line. */
function SpokeName({ words, x, y }: { words: string; x: number; y: number }) {
  const lines = words.split(" ");
  const anchor = x > 20 ? "start" : x < -20 ? "end" : "middle";
  return (
    <text x={x} y={y - 6 * (lines.length - 1)} textAnchor={anchor} dominantBaseline="middle">
      {lines.map((line, n) => (
        <tspan key={line} x={x} dy={n === 0 ? 0 : 14}>
          {line}
        </tspan>
      ))}
    </text>
  );
}
