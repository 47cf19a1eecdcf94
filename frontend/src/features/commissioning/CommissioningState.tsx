import "./catalogue";
import { Alert, Group, Text } from "@mantine/core";
import { IconInfoCircle } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { api, type Schemas } from "../../lib/api/client";
import { formatDayOf } from "../../lib/format";
import { t } from "../../lib/i18n";
import { translateServerText } from "../../lib/serverText";
import { PageLink } from "../../ui/links";
import { RequirePermission } from "../auth/RequirePermission";

const REFETCH_MS = 60_000;

/**
 * Query whether this station is commissioned. The service reads the state from its own disk, so it works
 * without the database.
 */
export const useCommissioningStatus = () =>
  useQuery({
    queryKey: ["commissioning-status"],
    queryFn: api.commissioningStatus,
    refetchInterval: REFETCH_MS,
  });

/** Return the state in one sentence. */
export function describeState(status: Schemas["CommissioningState"]): string {
  if (status.state === "not_needed") return t("commissioning:state.notNeeded");
  if (status.state === "not_commissioned") {
    const reason = translateServerText(status.reason, status.reason_key);
    return t("commissioning:state.notCommissioned", { reason });
  }
  const days = { on: formatDayOf(status.commissioned_at ?? ""), due: formatDayOf(status.due_at ?? "") };
  return t(`commissioning:state.${status.state}`, days);
}

/** Shows the state and what to do about it. `link`: also link to the records and settings. */
export function CommissioningState({ link = false }: { link?: boolean }) {
  const { data: status } = useCommissioningStatus();
  if (!status) return null;
  const words = describeState(status);
  const page = link && (
    <RequirePermission permission="see_operation">
      <PageLink to="/commissioning">{t("commissioning:page.title")}</PageLink>
    </RequirePermission>
  );
  if (status.state === "due" || status.state === "not_commissioned") {
    const next = status.state === "due" ? "dueNext" : "notCommissionedNext";
    return (
      <Alert color="grape" variant="light" icon={<IconInfoCircle />} role="alert" data-testid="commissioning">
        <Text fw={600}>{words}</Text>
        <Text size="sm">{t(`commissioning:state.${next}`)}</Text>
        {page}
      </Alert>
    );
  }
  return (
    <Group gap="sm" data-testid="commissioning">
      <Text size="sm">{words}</Text>
      {page}
    </Group>
  );
}
