import { Table, Text } from "@mantine/core";
import type { ProgrammeVersion } from "../../lib/api/client";
import { formatSpan } from "../../lib/format";
import { PageLink } from "../../ui/links";
import { itemWords } from "./describeProgramme";
import { ITEMS, VERSIONS } from "./messages";

/** The items of a programme version, read-only. */
export function ItemTable({ version }: { version: ProgrammeVersion }) {
  return (
    <Table verticalSpacing="sm" aria-label={VERSIONS.one(version.number)}>
      <Table.Thead>
        <Table.Tr>
          <Table.Th w={40}>{ITEMS.number}</Table.Th>
          <Table.Th>{ITEMS.recording}</Table.Th>
          <Table.Th>{ITEMS.played}</Table.Th>
          <Table.Th ta="right">{ITEMS.time}</Table.Th>
        </Table.Tr>
      </Table.Thead>
      <Table.Tbody>
        {version.items.map((item) => (
          <Table.Tr key={item.position}>
            <Table.Td>{item.position}</Table.Td>
            <Table.Td>
              <PageLink to="/recordings/$recordingId" params={{ recordingId: item.recording_id }}>
                {item.recording_name}
              </PageLink>
              {item.recording_archived && <Text size="sm">{ITEMS.archived}</Text>}
            </Table.Td>
            <Table.Td>{itemWords(item)}</Table.Td>
            <Table.Td ta="right">{formatSpan(item.duration_s)}</Table.Td>
          </Table.Tr>
        ))}
      </Table.Tbody>
    </Table>
  );
}
