import "./catalogue";
import { Badge, Table, Text } from "@mantine/core";
import type { Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { translateServerText } from "../../lib/serverText";
import { describeRecordedValue } from "./describeSetting";

type Result = { passed: boolean; fault: string; fault_key?: Schemas["TextKey"] | null };

/** Return in words whether a step or a record has passed, or its fault. */
export const describeStepResult = ({ passed, fault, fault_key }: Result): string =>
  passed
    ? t("commissioning:records.passed")
    : t("commissioning:records.failed", { fault: translateServerText(fault, fault_key) });

/** Shows whether a step has passed, or its fault. */
export function StepResult({ run }: { run: Result }) {
  if (!run.passed) return <Text fw={600}>{describeStepResult(run)}</Text>;
  return (
    <Badge variant="light" color="gray" tt="none">
      {describeStepResult(run)}
    </Badge>
  );
}

const STEPS: Partial<{ [step: string]: string }> = t("commissioning:steps", { returnObjects: true });
/** Return the name of a step. */
export const stepName = (step: string) => STEPS[step] ?? step;

const recordedValue = (value: number | string | null) =>
  typeof value === "string" ? describeRecordedValue(value) : (value ?? "–");

/** Registers are long numbers without a space. Unbroken, they push the last column out of the record's dialog. */
const LONG = { overflowWrap: "anywhere" } as const;

/** Shows the values before and after a step. */
export function Values({ values }: { values: Schemas["CommissioningValue"][] }) {
  return (
    <Table verticalSpacing={2} fz="sm">
      <Table.Thead>
        <Table.Tr>
          <Table.Th>{t("commissioning:steps.motor")}</Table.Th>
          <Table.Th>{t("commissioning:steps.value")}</Table.Th>
          <Table.Th ta="right">{t("commissioning:steps.before")}</Table.Th>
          <Table.Th ta="right">{t("commissioning:steps.after")}</Table.Th>
        </Table.Tr>
      </Table.Thead>
      <Table.Tbody>
        {values.map((value) => (
          <Table.Tr key={`${value.motor} ${value.name}`}>
            <Table.Td>{value.motor || "–"}</Table.Td>
            <Table.Td>{describeRecordedValue(value.name)}</Table.Td>
            <Table.Td ta="right" style={LONG}>
              {recordedValue(value.before)}
            </Table.Td>
            <Table.Td ta="right" style={LONG}>
              {recordedValue(value.after)}
            </Table.Td>
          </Table.Tr>
        ))}
      </Table.Tbody>
    </Table>
  );
}
