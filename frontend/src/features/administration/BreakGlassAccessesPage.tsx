import "./catalogue";
import { Badge, Button, Card, Group, Skeleton, Stack, Text, Title } from "@mantine/core";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { useTitle } from "../../app/title";
import { api, type Schemas } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { usePagedQuery } from "../../lib/usePagedQuery";
import { LoadMoreButton } from "../../ui/LoadMoreButton";
import { PageLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import { useMe } from "../auth/hooks";

/** Break-glass accesses to restricted records ("emergency access" on the page). Another administrator reviews each one. */
export function BreakGlassAccessesPage() {
  useTitle(t("administration:breakGlassAccesses.title"));
  const accesses = usePagedQuery(["break-glass-accesses"], api.breakGlassAccesses);
  return (
    <Stack component="section" aria-label={t("administration:breakGlassAccesses.title")}>
      <Title order={2} size="h3">
        {t("administration:breakGlassAccesses.title")}
      </Title>
      <Text>{t("administration:breakGlassAccesses.description")}</Text>
      <ProblemNote error={accesses.error} />
      {accesses.isPending && <Skeleton h={160} />}
      {accesses.items?.length === 0 && <Text>{t("administration:breakGlassAccesses.none")}</Text>}
      {accesses.items?.map((access) => (
        <BreakGlassAccessCard key={access.id} access={access} />
      ))}
      <LoadMoreButton list={accesses} />
    </Stack>
  );
}

function BreakGlassAccessCard({ access }: { access: Schemas["BreakGlassAccess"] }) {
  const me = useMe();
  const queries = useQueryClient();
  const review = useMutation({
    mutationFn: () => api.reviewBreakGlassAccess(access.id),
    onSuccess: () => queries.invalidateQueries({ queryKey: ["break-glass-accesses"] }),
  });
  return (
    <Card withBorder data-testid="opened">
      <Stack gap="xs">
        <Group justify="space-between">
          <Text fw={600}>
            {t("administration:breakGlassAccesses.opened", {
              name: access.name,
              moment: formatMoment(access.at),
            })}
          </Text>
          {access.reviewed_at ? (
            <Badge color="gray" tt="none" size="lg">
              {t("administration:breakGlassAccesses.reviewed", {
                name: access.reviewed_by,
                moment: formatMoment(access.reviewed_at),
              })}
            </Badge>
          ) : (
            <Badge color="grape" tt="none" size="lg">
              {t("administration:breakGlassAccesses.toReview")}
            </Badge>
          )}
        </Group>
        <Text style={{ whiteSpace: "pre-wrap" }}>{access.reason}</Text>
        <Group>
          <PageLink
            to="/administration/audit"
            search={{ patient_id: access.patient_id, account_id: access.account_id }}
          >
            {t("administration:breakGlassAccesses.actions")}
          </PageLink>
          {!access.reviewed_at && access.account_id !== me?.account_id && (
            <Button variant="default" loading={review.isPending} onClick={() => review.mutate()}>
              {t("administration:breakGlassAccesses.review")}
            </Button>
          )}
          {!access.reviewed_at && access.account_id === me?.account_id && (
            <Text>{t("administration:breakGlassAccesses.own")}</Text>
          )}
        </Group>
        <ProblemNote error={review.error} />
      </Stack>
    </Card>
  );
}
