import { Group, Text, Title } from "@mantine/core";
import { formatMoment } from "../../../lib/format";
import { t } from "../../../lib/i18n";
import { useNewestSession } from "../../../lib/patientQueries";
import { PageLink } from "../../../ui/links";
import { ProblemNote } from "../../../ui/ProblemNote";
import { SimulatedBadge } from "../../../ui/SimulatedBadge";
import { ResultMetrics, Verdict } from "../../sessions/SessionResult";

/** Shows how the newest session went, with a link to it. */
export function LastSession({ patientId }: { patientId: string }) {
  const newest = useNewestSession(patientId);
  const title = t("patients:summary.lastSession");
  return (
    <section aria-label={title}>
      <Group justify="space-between" gap="xs">
        <Title order={2} size="h4">
          {title}
        </Title>
        {newest.data && (
          <PageLink to="/sessions/$sessionId" params={{ sessionId: newest.data.id }}>
            {formatMoment(newest.data.started_at)}
          </PageLink>
        )}
      </Group>
      <ProblemNote error={newest.error} />
      {newest.isSuccess && !newest.data && <Text>{t("sessions:sessions.none")}</Text>}
      {newest.data && (
        <>
          <Group gap="xs" my="xs">
            <Verdict session={newest.data} />
            <SimulatedBadge simulated={newest.data.simulated} />
          </Group>
          <ResultMetrics session={newest.data} />
        </>
      )}
    </section>
  );
}
