import { Card, Group, Select, Stack, Table, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { api, type Session } from "../../lib/api/client";
import { formatList, formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { usePagedQuery } from "../../lib/usePagedQuery";
import { LoadMoreButton } from "../../ui/LoadMoreButton";
import { ProblemNote } from "../../ui/ProblemNote";
import { ScrolledTable } from "../../ui/ScrolledTable";
import { compareSessions, treatDifferentShoulders } from "./compareSessions";
import { Head, Row } from "./figureRows";
import { describeShoulder } from "./SessionResult";

/** Compares this session with another session of the patient. */
export function SessionComparison({ session }: { session: Session }) {
  const patientId = session.patient.id;
  const [chosen, setChosen] = useState<string | null>(null);
  const sessions = usePagedQuery(["sessions", "of", patientId], (after) =>
    api.patientSessions(patientId, after),
  );
  const other = useQuery({
    queryKey: ["session", chosen],
    queryFn: () => api.session(chosen ?? ""),
    enabled: chosen !== null,
  });
  const others = (sessions.items ?? []).filter(({ id }) => id !== session.id);
  if (others.length === 0) return null;
  return (
    <Card withBorder component="section" aria-label={t("sessions:comparison.title")}>
      <Stack>
        <Title order={2} size="h3">
          {t("sessions:comparison.title")}
        </Title>
        <Group align="end">
          <Select
            label={t("sessions:comparison.session")}
            placeholder={t("sessions:comparison.none")}
            w={320}
            clearable
            data={others.map(({ id, started_at }) => ({ value: id, label: formatMoment(started_at) }))}
            value={chosen}
            onChange={setChosen}
          />
          <LoadMoreButton list={sessions} words={t("sessions:comparison.older")} />
        </Group>
        <ProblemNote error={sessions.error ?? other.error} />
        {chosen && other.data && <ComparisonTable other={other.data} here={session} />}
      </Stack>
    </Card>
  );
}

function ComparisonTable({ other, here }: { other: Session; here: Session }) {
  const apart = treatDifferentShoulders(other, here);
  return (
    <ScrolledTable minWidth={640}>
      {apart && <Text fw={600}>{t("sessions:comparison.otherShoulder")}</Text>}
      <Table withTableBorder verticalSpacing="xs" data-testid="beside">
        <Table.Caption>
          {t("sessions:comparison.caption")} {t("sessions:result.slip")}
        </Table.Caption>
        <Head
          first={t("sessions:comparison.measure")}
          others={[
            describeHeading(other, formatMoment(other.started_at)),
            describeHeading(here, t("sessions:comparison.here", { at: formatMoment(here.started_at) })),
            t("sessions:comparison.change"),
          ]}
        />
        {compareSessions(other, here).map((part) => (
          <Table.Tbody key={part.key}>
            <Table.Tr>
              <Table.Th colSpan={4} scope="rowgroup">
                {part.title}
              </Table.Th>
            </Table.Tr>
            {part.lines.map((line) => (
              <Row
                key={line.measure}
                first={line.measure}
                others={[line.other, line.here, apart ? "" : line.change]}
              />
            ))}
          </Table.Tbody>
        ))}
      </Table>
    </ScrolledTable>
  );
}

/** Return the time of a session, its shoulder, and whether its apparatus was simulated. */
const describeHeading = ({ side, simulated }: Session, at: string) =>
  formatList([at, describeShoulder(side), ...(simulated ? [t("common:simulated")] : [])]);
