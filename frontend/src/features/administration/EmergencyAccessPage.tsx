import { Badge, Button, Card, Group, Skeleton, Stack, Text, Title } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useTitle } from "../../app/title";
import { api, type Schemas } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { PageLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import { useMe } from "../auth/hooks";
import { EMERGENCIES } from "./messages";

/** Emergency accesses to restricted records. Another administrator reviews each one. */
export function EmergencyAccessPage() {
  useTitle(EMERGENCIES.title);
  const accesses = useQuery({ queryKey: ["broken-glass"], queryFn: api.breakGlassAccesses });
  return (
    <Stack component="section" aria-label={EMERGENCIES.title}>
      <Title order={2} size="h3">
        {EMERGENCIES.title}
      </Title>
      <Text>{EMERGENCIES.means}</Text>
      <ProblemNote error={accesses.error} />
      {accesses.isPending && <Skeleton h={160} />}
      {accesses.data?.items.length === 0 && <Text>{EMERGENCIES.none}</Text>}
      {accesses.data?.items.map((access) => (
        <AccessCard key={access.id} access={access} />
      ))}
    </Stack>
  );
}

function AccessCard({ access }: { access: Schemas["BreakGlassAccess"] }) {
  const me = useMe();
  const queries = useQueryClient();
  const review = useMutation({
    mutationFn: () => api.reviewBreakGlassAccess(access.id),
    onSuccess: () => queries.invalidateQueries({ queryKey: ["broken-glass"] }),
  });
  return (
    <Card withBorder data-testid="opened">
      <Stack gap="xs">
        <Group justify="space-between">
          <Text fw={600}>{EMERGENCIES.opened(access.name, formatMoment(access.at))}</Text>
          {access.reviewed_at ? (
            <Badge color="gray" tt="none" size="lg">
              {EMERGENCIES.reviewed(access.reviewed_by, formatMoment(access.reviewed_at))}
            </Badge>
          ) : (
            <Badge color="grape" tt="none" size="lg">
              {EMERGENCIES.toReview}
            </Badge>
          )}
        </Group>
        <Text style={{ whiteSpace: "pre-wrap" }}>{access.reason}</Text>
        <Group>
          <PageLink
            to="/administration/audit"
            search={{ patient_id: access.patient_id, account_id: access.account_id }}
          >
            {EMERGENCIES.done}
          </PageLink>
          {!access.reviewed_at && access.account_id !== me?.account_id && (
            <Button variant="default" loading={review.isPending} onClick={() => review.mutate()}>
              {EMERGENCIES.review}
            </Button>
          )}
          {!access.reviewed_at && access.account_id === me?.account_id && <Text>{EMERGENCIES.own}</Text>}
        </Group>
        <ProblemNote error={review.error} />
      </Stack>
    </Card>
  );
}
