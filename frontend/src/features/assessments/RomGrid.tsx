import { Alert, Button, Table, Text, TextInput } from "@mantine/core";
import { IconAlertTriangle } from "@tabler/icons-react";
import { type KeyboardEvent, useState } from "react";
import type { Assessment, Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { angleKey, angleProblem, type Kind, otherZeroNote, type Side } from "./draft";
import { measureName } from "./messages";
import { ThirdPosition } from "./ThirdPosition";

type Measure = Schemas["RomMeasure"];

/** Motions that are measured in every shoulder. The others are shown on request or if they have a value. */
const USUAL = new Set(["flexion", "extension", "abduction", "horizontal_flexion", "horizontal_extension"]);
const isUsual = (measure: Measure) => USUAL.has(measure.motion) || measure.position === "at_side";

/**
 * The table of angles, with a row per motion and the affected side first. Tab moves across, Enter moves down.
 * Empty fields show the angles of the last assessment.
 */
export function RomGrid(props: {
  measures: Measure[];
  affected: Side;
  typed: Record<string, string>;
  last: Assessment | null;
  onChange: (typed: Record<string, string>) => void;
}) {
  const { measures, affected, typed } = props;
  const sides: Side[] = affected === "left" ? ["left", "right"] : ["right", "left"];
  const columns = columnsOf(sides);
  const hasValue = (measure: Measure) =>
    columns.some(({ side, kind }) => typed[angleKey({ ...measure, side, kind })] !== undefined);
  const [showAll, setShowAll] = useState(() =>
    measures.some((measure) => !isUsual(measure) && hasValue(measure)),
  );
  const shown = showAll ? measures : measures.filter(isUsual);
  const lastAngles = new Map(props.last?.rom.map((entry) => [angleKey(entry), entry.angle_deg]));
  const problems = shown.flatMap((measure) =>
    columns.map(({ side, kind }) => angleProblem(measure, typed[angleKey({ ...measure, side, kind })] ?? "")),
  );
  const notes = shown.flatMap((measure) =>
    columns.map((column) => otherZeroNote(measures, measure, typed, column)),
  );
  return (
    <>
      <Table aria-label={t("assessments:rom.title")} verticalSpacing={4} horizontalSpacing={6} w="auto">
        <RomHeader sides={sides} affected={affected} />
        <Table.Tbody>
          {shown.map((measure, row) => (
            <Table.Tr key={measure.motion + measure.position}>
              <Table.Th scope="row" fw={500}>
                {measureName(measure)}
              </Table.Th>
              {columns.map(({ side, kind }, column) => {
                const key = angleKey({ ...measure, side, kind });
                const value = typed[key] ?? "";
                return (
                  <Table.Td key={key}>
                    <TextInput
                      w={84}
                      inputMode="decimal"
                      autoComplete="off"
                      data-row={row}
                      data-column={column}
                      aria-label={t(`assessments:rom.cell.${side}.${kind}`, {
                        measure: measureName(measure),
                      })}
                      placeholder={lastAngles.get(key)?.toString() ?? ""}
                      value={value}
                      error={angleProblem(measure, value) !== null}
                      onChange={(event) => props.onChange({ ...typed, [key]: event.currentTarget.value })}
                      onKeyDown={(event) => moveDown(event, row, column)}
                      styles={{ input: { textAlign: "right" } }}
                    />
                  </Table.Td>
                );
              })}
              <Table.Td ta="right">{measure.reference_deg}</Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
      <Text size="sm" c="dimmed">
        {t("assessments:rom.sources")}
      </Text>
      {[...new Set(problems)].map(
        (problem) =>
          problem && (
            <Text key={problem} c="grape.9" role="alert">
              {problem}
            </Text>
          ),
      )}
      {notes.map(
        (note) =>
          note && (
            <Alert key={note} color="grape" variant="light" role="status" icon={<IconAlertTriangle />}>
              {note}
            </Alert>
          ),
      )}
      {showAll && <ThirdPosition />}
      {!showAll && (
        <Button variant="subtle" onClick={() => setShowAll(true)}>
          {t("assessments:rom.more")}
        </Button>
      )}
    </>
  );
}

const columnsOf = (sides: Side[]) =>
  sides.flatMap((side) => (["active", "passive"] as Kind[]).map((kind) => ({ side, kind })));

function RomHeader({ sides, affected }: { sides: Side[]; affected: Side }) {
  return (
    <Table.Thead>
      <Table.Tr>
        <Table.Th rowSpan={2}>{t("assessments:rom.degrees")}</Table.Th>
        {sides.map((side) => (
          <Table.Th key={side} colSpan={2}>
            {side === affected ? t(`assessments:rom.affected.${side}`) : t(`assessments:rom.side.${side}`)}
          </Table.Th>
        ))}
        <Table.Th rowSpan={2} ta="right">
          {t("assessments:rom.reference")}
        </Table.Th>
      </Table.Tr>
      <Table.Tr>
        {columnsOf(sides).map(({ side, kind }) => (
          <Table.Th key={side + kind}>{t(`assessments:kinds.${kind}`)}</Table.Th>
        ))}
      </Table.Tr>
    </Table.Thead>
  );
}

/** On Enter, move the focus down, and from the last row to the top of the next column. */
function moveDown(event: KeyboardEvent<HTMLInputElement>, row: number, column: number) {
  if (event.key !== "Enter") return;
  event.preventDefault();
  const below = `[data-row="${row + 1}"][data-column="${column}"]`;
  const top = `[data-row="0"][data-column="${column + 1}"]`;
  const table = event.currentTarget.closest("table");
  (table?.querySelector<HTMLInputElement>(below) ?? table?.querySelector<HTMLInputElement>(top))?.focus();
}
