import { Table, Text } from "@mantine/core";
import type { ProgrammeVersion } from "../api/client";
import { formatSpan } from "../shared/format";
import { PageLink } from "../shared/links";
import { itemWords } from "./words";

/** What a version says, recording by recording, to be read. */
export function ItemTable({ version }: { version: ProgrammeVersion }) {
  return (
    <Table verticalSpacing="sm" aria-label={`Version ${version.number}`}>
      <Table.Thead>
        <Table.Tr>
          <Table.Th w={40}>No.</Table.Th>
          <Table.Th>Recording</Table.Th>
          <Table.Th>How it is played</Table.Th>
          <Table.Th ta="right">Time</Table.Th>
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
              {item.recording_archived && (
                <Text size="sm">Archived: it cannot be played until it is restored.</Text>
              )}
            </Table.Td>
            <Table.Td>{itemWords(item)}</Table.Td>
            <Table.Td ta="right">{formatSpan(item.duration_s)}</Table.Td>
          </Table.Tr>
        ))}
      </Table.Tbody>
    </Table>
  );
}
