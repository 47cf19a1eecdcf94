import "./catalogue";
import { Table, Text } from "@mantine/core";
import type { ProgrammeVersion } from "../../lib/api/client";
import { formatDuration } from "../../lib/format";
import { t } from "../../lib/i18n";
import { PageLink } from "../../ui/links";
import { describePrescription } from "./describeProgramme";

/** The items of a programme version, read-only. */
export function ItemTable({ version }: { version: ProgrammeVersion }) {
  return (
    <Table verticalSpacing="sm" aria-label={t("programmes:versions.number", { number: version.number })}>
      <Table.Thead>
        <Table.Tr>
          <Table.Th w={40}>{t("programmes:items.number")}</Table.Th>
          <Table.Th>{t("programmes:items.recording")}</Table.Th>
          <Table.Th>{t("programmes:items.played")}</Table.Th>
          <Table.Th ta="right">{t("programmes:items.time")}</Table.Th>
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
              {item.recording_archived && <Text size="sm">{t("programmes:items.archived")}</Text>}
            </Table.Td>
            <Table.Td>{describePrescription(item)}</Table.Td>
            <Table.Td ta="right">{formatDuration(item.duration_s)}</Table.Td>
          </Table.Tr>
        ))}
      </Table.Tbody>
    </Table>
  );
}
