import { Badge, Button, Card, Group, Skeleton, Stack, Text, Title } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useTitle } from "../../app/title";
import { api, type Schemas } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { PageLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import { useMe } from "../auth/hooks";
import { EMERGENCIES } from "./messages";

/** Restricted records that somebody opened in an emergency: each is looked at by somebody else. */
export function EmergencyAccessPage() {
  useTitle(EMERGENCIES.title);
  const broken = useQuery({ queryKey: ["broken-glass"], queryFn: api.brokenGlass });
  return (
    <Stack component="section" aria-label={EMERGENCIES.title}>
      <Title order={2} size="h3">
        {EMERGENCIES.title}
      </Title>
      <Text>{EMERGENCIES.means}</Text>
      <ProblemNote error={broken.error} />
      {broken.isPending && <Skeleton h={160} />}
      {broken.data?.items.length === 0 && <Text>{EMERGENCIES.none}</Text>}
      {broken.data?.items.map((one) => (
        <Opened key={one.id} one={one} />
      ))}
    </Stack>
  );
}

function Opened({ one }: { one: Schemas["BreakGlassAccess"] }) {
  const me = useMe();
  const queries = useQueryClient();
  const review = useMutation({
    mutationFn: () => api.reviewBrokenGlass(one.id),
    onSuccess: () => queries.invalidateQueries({ queryKey: ["broken-glass"] }),
  });
  return (
    <Card withBorder data-testid="opened">
      <Stack gap="xs">
        <Group justify="space-between">
          <Text fw={600}>{EMERGENCIES.opened(one.name, formatMoment(one.at))}</Text>
          {one.reviewed_at ? (
            <Badge color="gray" tt="none" size="lg">
              {EMERGENCIES.reviewed(one.reviewed_by, formatMoment(one.reviewed_at))}
            </Badge>
          ) : (
            <Badge color="grape" tt="none" size="lg">
              {EMERGENCIES.toReview}
            </Badge>
          )}
        </Group>
        <Text style={{ whiteSpace: "pre-wrap" }}>{one.reason}</Text>
        <Group>
          <PageLink
            to="/administration/audit"
            search={{ patient_id: one.patient_id, account_id: one.account_id }}
          >
            {EMERGENCIES.done}
          </PageLink>
          {!one.reviewed_at && one.account_id !== me?.account_id && (
            <Button variant="default" loading={review.isPending} onClick={() => review.mutate()}>
              {EMERGENCIES.review}
            </Button>
          )}
          {!one.reviewed_at && one.account_id === me?.account_id && <Text>{EMERGENCIES.own}</Text>}
        </Group>
        <ProblemNote error={review.error} />
      </Stack>
    </Card>
  );
}
