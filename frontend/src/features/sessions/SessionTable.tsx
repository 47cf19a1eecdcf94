import { Table, Text } from "@mantine/core";
import type { Schemas } from "../../lib/api/client";
import { formatAfter, formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { PageLink } from "../../ui/links";

/** A table of sessions, optionally with the patients' names. */
export function SessionTable(props: {
  items: Schemas["SessionSummary"][];
  withPatient?: boolean;
  narrowed?: boolean;
}) {
  if (props.items.length === 0) {
    return <Text>{props.narrowed ? t("sessions:sessions.noneMatches") : t("sessions:sessions.none")}</Text>;
  }
  return (
    <Table verticalSpacing="md" highlightOnHover>
      <Table.Thead>
        <Table.Tr>
          <Table.Th>{t("sessions:sessions.started")}</Table.Th>
          {props.withPatient && <Table.Th>{t("sessions:sessions.patient")}</Table.Th>}
          <Table.Th>{t("sessions:sessions.therapist")}</Table.Th>
          <Table.Th>{t("sessions:sessions.station")}</Table.Th>
          <Table.Th ta="right">{t("sessions:sessions.playbacks")}</Table.Th>
          <Table.Th ta="right">{t("sessions:sessions.stopped")}</Table.Th>
          <Table.Th>{t("sessions:sessions.ended")}</Table.Th>
          <Table.Th>{t("sessions:sessions.signed")}</Table.Th>
        </Table.Tr>
      </Table.Thead>
      <Table.Tbody>
        {props.items.map((session) => (
          <Table.Tr key={session.id}>
            <Table.Td>
              <PageLink to="/sessions/$sessionId" params={{ sessionId: session.id }}>
                {formatMoment(session.started_at)}
              </PageLink>
            </Table.Td>
            {props.withPatient && (
              <Table.Td>
                <PageLink to="/patients/$patientId" params={{ patientId: session.patient.id }}>
                  {session.patient.name}
                </PageLink>{" "}
                <Text span size="sm" c="dimmed">
                  {session.patient.clinic_number}
                </Text>
              </Table.Td>
            )}
            <Table.Td>{session.therapist || "–"}</Table.Td>
            <Table.Td>{session.station || "–"}</Table.Td>
            <Table.Td ta="right">{session.runs}</Table.Td>
            <Table.Td ta="right">{session.stops}</Table.Td>
            <Table.Td>
              {session.ended_at
                ? formatAfter(session.ended_at, session.started_at)
                : t("sessions:sessions.open")}
            </Table.Td>
            <Table.Td>
              {session.signed_at
                ? formatAfter(session.signed_at, session.started_at)
                : t("sessions:sessions.notSigned")}
            </Table.Td>
          </Table.Tr>
        ))}
      </Table.Tbody>
    </Table>
  );
}
