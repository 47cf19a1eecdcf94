import { Table, Text } from "@mantine/core";
import type { Schemas } from "../api/client";
import { formatMoment } from "../shared/format";
import { PageLink } from "../shared/links";

/** Sessions in a list; whose they are, where that is not said already. */
export function SessionTable(props: {
  items: Schemas["SessionSummary"][];
  withPatient?: boolean;
  narrowed?: boolean;
}) {
  if (props.items.length === 0) {
    return <Text>{props.narrowed ? "No session matches." : "There has been no session yet."}</Text>;
  }
  return (
    <Table verticalSpacing="md" highlightOnHover>
      <Table.Thead>
        <Table.Tr>
          <Table.Th>Began</Table.Th>
          {props.withPatient && <Table.Th>Patient</Table.Th>}
          <Table.Th>Therapist</Table.Th>
          <Table.Th>Station</Table.Th>
          <Table.Th ta="right">Playbacks</Table.Th>
          <Table.Th ta="right">Stopped</Table.Th>
          <Table.Th>Ended</Table.Th>
          <Table.Th>Signed</Table.Th>
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
            <Table.Td>{session.ended_at ? formatMoment(session.ended_at) : "Open"}</Table.Td>
            <Table.Td>{session.signed_at ? formatMoment(session.signed_at) : "Not yet"}</Table.Td>
          </Table.Tr>
        ))}
      </Table.Tbody>
    </Table>
  );
}
