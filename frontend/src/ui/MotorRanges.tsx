import { Table } from "@mantine/core";
import type { Schemas } from "../lib/api/client";
import { formatDeg } from "../lib/format";
import { RANGES } from "../lib/messages";

/** The range and the highest speed of each motor in a motion. */
export function MotorRanges({ ranges }: { ranges: Schemas["MotorRange"][] }) {
  return (
    <Table maw={640} withTableBorder verticalSpacing="xs">
      <Table.Thead>
        <Table.Tr>
          <Table.Th>{RANGES.motor}</Table.Th>
          <Table.Th ta="right">{RANGES.from}</Table.Th>
          <Table.Th ta="right">{RANGES.to}</Table.Th>
          <Table.Th ta="right">{RANGES.fastest}</Table.Th>
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
