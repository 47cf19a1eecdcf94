import { Table } from "@mantine/core";
import type { Schemas } from "../lib/api/client";
import { formatDeg } from "../lib/format";
import { t } from "../lib/i18n";

/** The range and the highest speed of each motor in a motion. */
export function MotorRanges({ ranges }: { ranges: Schemas["MotorRange"][] }) {
  return (
    <Table maw={640} withTableBorder verticalSpacing="xs" horizontalSpacing={6}>
      <Table.Thead>
        <Table.Tr>
          <Table.Th>{t("common:ranges.motor")}</Table.Th>
          <Table.Th ta="right">{t("common:ranges.from")}</Table.Th>
          <Table.Th ta="right">{t("common:ranges.to")}</Table.Th>
          <Table.Th ta="right">{t("common:ranges.fastest")}</Table.Th>
        </Table.Tr>
      </Table.Thead>
      <Table.Tbody>
        {ranges.map((range) => (
          <Table.Tr key={range.motor}>
            <Table.Td>{range.motor}</Table.Td>
            <Table.Td ta="right">{formatDeg(range.min_deg)}</Table.Td>
            <Table.Td ta="right">{formatDeg(range.max_deg)}</Table.Td>
            <Table.Td ta="right">{formatDeg(range.max_speed_deg_s, 0)}</Table.Td>
          </Table.Tr>
        ))}
      </Table.Tbody>
    </Table>
  );
}
