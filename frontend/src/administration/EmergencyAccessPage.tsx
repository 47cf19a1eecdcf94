import { Badge, Button, Card, Group, Skeleton, Stack, Text, Title } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useMe } from "../access/hooks";
import { api, type Schemas } from "../api/client";
import { formatMoment } from "../shared/format";
import { PageLink } from "../shared/links";
import { ProblemNote } from "../shared/problem";
import { useTitle } from "../shared/title";

/** Restricted records that somebody opened in an emergency: each is looked at by somebody else. */
export function EmergencyAccessPage() {
  useTitle("Emergency access");
  const broken = useQuery({ queryKey: ["broken-glass"], queryFn: api.brokenGlass });
  return (
    <Stack component="section" aria-label="Emergency access">
      <Title order={2} size="h3">
        Emergency access
      </Title>
      <Text>
        Restricted records that somebody opened though they are not in the care team. Look at each: what
        happened, and whether it was needed.
      </Text>
      <ProblemNote error={broken.error} />
      {broken.isPending && <Skeleton h={160} />}
      {broken.data?.items.length === 0 && <Text>Nobody has opened one.</Text>}
      {broken.data?.items.map((one) => (
        <Opened key={one.id} one={one} />
      ))}
    </Stack>
  );
}

function Opened({ one }: { one: Schemas["BrokenGlass"] }) {
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
          <Text fw={600}>
            {one.name}, {formatMoment(one.at)}
          </Text>
          {one.reviewed_at ? (
            <Badge color="gray" tt="none" size="lg">
              Looked at by {one.reviewed_by}, {formatMoment(one.reviewed_at)}
            </Badge>
          ) : (
            <Badge color="grape" tt="none" size="lg">
              To be looked at
            </Badge>
          )}
        </Group>
        <Text style={{ whiteSpace: "pre-wrap" }}>{one.reason}</Text>
        <Group>
          <PageLink
            to="/administration/audit"
            search={{ patient_id: one.patient_id, account_id: one.account_id }}
          >
            What was done in it
          </PageLink>
          {!one.reviewed_at && one.account_id !== me?.account_id && (
            <Button variant="default" loading={review.isPending} onClick={() => review.mutate()}>
              I have looked at it
            </Button>
          )}
          {!one.reviewed_at && one.account_id === me?.account_id && (
            <Text>Somebody else looks at what you did yourself.</Text>
          )}
        </Group>
        <ProblemNote error={review.error} />
      </Stack>
    </Card>
  );
}
