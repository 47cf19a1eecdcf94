import { Alert, Button, Card, Group, Stack, Text, Textarea, Title } from "@mantine/core";
import { IconLockExclamation } from "@tabler/icons-react";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { api } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { PageLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import { useRecordAccess } from "./RecordAccess";

/** Minimum length of a reason, so that the reviewer understands it. */
const MIN_REASON_LENGTH = 10;

/** Shown in place of a restricted record: a form for a break-glass access, which the page calls emergency access. */
export function BreakGlassAccessForm({ patientId }: { patientId: string }) {
  const queries = useQueryClient();
  const [reason, setReason] = useState("");
  const open = useMutation({
    mutationFn: () => api.breakGlass(patientId, { reason }),
    onSuccess: () => queries.invalidateQueries(),
  });
  return (
    <Card withBorder maw={720} p="xl" component="section" aria-label={t("auth:record.title")}>
      <Stack>
        <Group gap="sm">
          <IconLockExclamation size={28} />
          <Title order={1} size="h2">
            {t("auth:record.isRestricted")}
          </Title>
        </Group>
        <Text>{t("auth:record.description")}</Text>
        <Textarea
          label={t("auth:record.reason")}
          description={t("auth:record.reasonHint")}
          autosize
          minRows={3}
          maxLength={1000}
          value={reason}
          onChange={(event) => setReason(event.currentTarget.value)}
        />
        <ProblemNote error={open.error} />
        <Group>
          <Button
            size="lg"
            color="grape"
            disabled={reason.trim().length < MIN_REASON_LENGTH}
            loading={open.isPending}
            onClick={() => open.mutate()}
          >
            {t("auth:record.open")}
          </Button>
          <PageLink to="/patients">{t("auth:record.back")}</PageLink>
        </Group>
      </Stack>
    </Card>
  );
}

/** Says that the user sees the record through a break-glass access. */
export function BreakGlassAccessBanner({ patientId }: { patientId: string }) {
  const access = useRecordAccess(patientId);
  if (!access.data?.glass_until) return null;
  return (
    <Alert
      color="grape"
      variant="filled"
      icon={<IconLockExclamation />}
      title={t("auth:record.opened", { until: formatMoment(access.data.glass_until) })}
      data-testid="break-glass-access"
    >
      {t("auth:record.recorded")}
    </Alert>
  );
}
