import { Button, Table, Text, TextInput } from "@mantine/core";
import { type KeyboardEvent, useState } from "react";
import type { Assessment, Schemas } from "../../lib/api/client";
import { angleProblem, cell, type Kind, type Side } from "./draft";
import { KINDS, measureName, ROM } from "./messages";

type Measure = Schemas["RomMeasure"];

/** Measured in every shoulder; the rest is shown when it is asked for, or holds something. */
const USUAL = new Set(["flexion", "extension", "abduction", "horizontal_flexion", "horizontal_extension"]);
const isUsual = (measure: Measure) => USUAL.has(measure.motion) || measure.position === "at_side";

/**
 * Motions down, left and right and active and passive across, the affected side first. Tab goes across and Enter down; the last
 * time's angles stand in the empty fields.
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
  const columns = sides.flatMap((side) => (["active", "passive"] as Kind[]).map((kind) => ({ side, kind })));
  const holdsSomething = (measure: Measure) =>
    columns.some(({ side, kind }) => typed[cell({ ...measure, side, kind })] !== undefined);
  const [all, setAll] = useState(() => measures.some((one) => !isUsual(one) && holdsSomething(one)));
  const shown = all ? measures : measures.filter(isUsual);
  const last = new Map(props.last?.rom.map((entry) => [cell(entry), entry.angle_deg]));
  const problems = shown.flatMap((measure) =>
    columns.map(({ side, kind }) => angleProblem(measure, typed[cell({ ...measure, side, kind })] ?? "")),
  );
  const goDown = (event: KeyboardEvent<HTMLInputElement>, row: number, column: number) => {
    if (event.key !== "Enter") return;
    event.preventDefault();
    const below = `[data-row="${row + 1}"][data-column="${column}"]`;
    const top = `[data-row="0"][data-column="${column + 1}"]`;
    const table = event.currentTarget.closest("table");
    (table?.querySelector<HTMLInputElement>(below) ?? table?.querySelector<HTMLInputElement>(top))?.focus();
  };
  return (
    <>
      <Table aria-label={ROM.title} verticalSpacing={4} horizontalSpacing={6} w="auto">
        <Table.Thead>
          <Table.Tr>
            <Table.Th rowSpan={2}>{ROM.degrees}</Table.Th>
            {sides.map((side) => (
              <Table.Th key={side} colSpan={2}>
                {side === affected ? ROM.affected(side) : ROM.side(side)}
              </Table.Th>
            ))}
            <Table.Th rowSpan={2} ta="right">
              {ROM.reference}
            </Table.Th>
          </Table.Tr>
          <Table.Tr>
            {columns.map(({ side, kind }) => (
              <Table.Th key={side + kind}>{KINDS[kind]}</Table.Th>
            ))}
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {shown.map((measure, row) => (
            <Table.Tr key={measure.motion + measure.position}>
              <Table.Th scope="row" fw={500}>
                {measureName(measure)}
              </Table.Th>
              {columns.map(({ side, kind }, column) => {
                const key = cell({ ...measure, side, kind });
                const value = typed[key] ?? "";
                return (
                  <Table.Td key={key}>
                    <TextInput
                      w={84}
                      inputMode="decimal"
                      autoComplete="off"
                      data-row={row}
                      data-column={column}
                      aria-label={ROM.cell(measureName(measure), side, kind)}
                      placeholder={last.get(key)?.toString() ?? ""}
                      value={value}
                      error={angleProblem(measure, value) !== null}
                      onChange={(event) => props.onChange({ ...typed, [key]: event.currentTarget.value })}
                      onKeyDown={(event) => goDown(event, row, column)}
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
      {[...new Set(problems)].map(
        (problem) =>
          problem && (
            <Text key={problem} c="grape.9" role="alert">
              {problem}
            </Text>
          ),
      )}
      {!all && (
        <Button variant="subtle" onClick={() => setAll(true)}>
          {ROM.more}
        </Button>
      )}
    </>
  );
}
