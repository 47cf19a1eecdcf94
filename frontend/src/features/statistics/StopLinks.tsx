import { Table } from "@mantine/core";
import type { Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { PageLink } from "../../ui/links";
import { useHasPermission } from "../auth/hooks";
import { stopWords } from "../sessions/stopWords";

/** Shows the causes by station. For users who may read records, each links to its sessions. */
export function StopLinks(props: { rows: Schemas["StopCount"][]; days: { from: string; to: string } }) {
  const reads = useHasPermission("read_records");
  return (
    <Table.ScrollContainer minWidth={320}>
      <Table verticalSpacing="xs" aria-label={t("clinic:subjects.stops.title")}>
        <Table.Thead>
          <Table.Tr>
            <Table.Th>{t("clinic:figures.cause")}</Table.Th>
            <Table.Th>{t("clinic:figures.station")}</Table.Th>
            <Table.Th ta="right">{t("clinic:figures.sessions")}</Table.Th>
            <Table.Th ta="right">{t("clinic:figures.alarms")}</Table.Th>
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {props.rows.map(({ code, station, sessions, alarms }) => (
            <Table.Tr key={`${code} ${station}`}>
              <Table.Td>
                {reads && sessions > 0 ? (
                  <PageLink
                    to="/sessions"
                    search={{ stop: code, ...(station && { station }), ...props.days }}
                  >
                    {stopWords(code)}
                  </PageLink>
                ) : (
                  stopWords(code)
                )}
              </Table.Td>
              <Table.Td>{station || "–"}</Table.Td>
              <Table.Td ta="right">{sessions}</Table.Td>
              <Table.Td ta="right">{alarms}</Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
    </Table.ScrollContainer>
  );
}
