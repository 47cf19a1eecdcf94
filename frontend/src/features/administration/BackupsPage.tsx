import "./catalogue";
import { Alert, Badge, Button, Group, List, Skeleton, Stack, Text, Title } from "@mantine/core";
import { IconCircleCheck, IconDatabaseExport, IconFileZip, IconInfoCircle } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useTitle } from "../../app/title";
import { api, type Schemas } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { replaceData } from "../../lib/replaceData";
import { DataTable } from "../../ui/DataTable";
import { HelpLink } from "../../ui/HelpLink";
import { ProblemNote } from "../../ui/ProblemNote";
import type { Column } from "../../ui/tableRows";

type Backup = Schemas["Backup"];

const POLL_WHILE_RUNNING_MS = 2_000;

/** The backups with the results of their test restores. */
export function BackupsPage() {
  useTitle(t("administration:backups.title"));
  const queries = useQueryClient();
  const backups = useQuery({
    queryKey: ["backups"],
    queryFn: api.backups,
    refetchInterval: (query) => (query.state.data?.running ? POLL_WHILE_RUNNING_MS : false),
  });
  const makeBackup = useMutation({
    mutationFn: api.makeBackup,
    onSuccess: (list) => replaceData(queries, ["backups"], list),
  });
  const list = backups.data;
  return (
    <Stack component="section" aria-label={t("administration:backups.title")}>
      <Group justify="space-between">
        <Group>
          <Title order={2} size="h3">
            {t("administration:backups.title")}
          </Title>
          <HelpLink topic="backups" subject={t("administration:backups.title")} />
        </Group>
        <Button
          leftSection={<IconDatabaseExport size={20} />}
          loading={makeBackup.isPending || list?.running === true}
          onClick={() => makeBackup.mutate()}
        >
          {t("administration:backups.make")}
        </Button>
      </Group>
      <ProblemNote error={backups.error ?? makeBackup.error} />
      {backups.isPending && <Skeleton h={160} />}
      {list && (
        <>
          <LastVerifiedBackup list={list} />
          <BackupSettings list={list} />
          {list.running && <Text role="status">{t("administration:backups.making")}</Text>}
          {list.items.length > 0 && (
            <DataTable
              name="backups"
              label={t("administration:backups.title")}
              columns={COLUMNS}
              rows={list.items}
              rowKey={({ id }) => id}
              dense
            />
          )}
        </>
      )}
      <Support />
    </Stack>
  );
}

/** The download of the support bundle, which describes this installation to its maintainers. */
function Support() {
  return (
    <Stack component="section" gap="xs" align="flex-start" aria-label={t("administration:support.title")}>
      <Title order={3} size="h4">
        {t("administration:support.title")}
      </Title>
      <Text>{t("administration:support.explain")}</Text>
      <Button
        component="a"
        href="/api/support-bundle"
        download
        variant="default"
        leftSection={<IconFileZip size={20} />}
      >
        {t("administration:support.download")}
      </Button>
    </Stack>
  );
}

/** The newest backup that was restored successfully in a test. */
function LastVerifiedBackup({ list }: { list: Schemas["BackupList"] }) {
  const lastGood = list.last_good;
  return lastGood?.tested_at ? (
    <Alert color="indigo" variant="light" icon={<IconCircleCheck />} data-testid="last-good">
      {t("administration:backups.lastGood", {
        made: formatMoment(lastGood.at),
        tried: formatMoment(lastGood.tested_at),
      })}
    </Alert>
  ) : (
    <Alert color="grape" variant="light" icon={<IconInfoCircle />} role="alert" data-testid="last-good">
      {t("administration:backups.noneGood")}
    </Alert>
  );
}

function BackupSettings({ list }: { list: Schemas["BackupList"] }) {
  return (
    <List>
      <List.Item>
        {list.next_at
          ? t("administration:backups.next", { moment: formatMoment(list.next_at) })
          : t("administration:backups.noneScheduled")}
      </List.Item>
      <List.Item>{t("administration:backups.folder", { folder: list.folder })}</List.Item>
      {list.same_disk && (
        <List.Item>
          <b>{t("administration:backups.sameDisk")}</b>
        </List.Item>
      )}
      <List.Item>
        {t(`administration:keys.${list.key}`)}
        {list.key === "here" && t("administration:backups.keyFile", { file: list.key_file })}
      </List.Item>
    </List>
  );
}

const COLUMNS: Column<Backup>[] = [
  {
    key: "made",
    head: t("administration:backups.made"),
    always: true,
    value: ({ at }) => at,
    cell: (backup) => (
      <>
        {formatMoment(backup.at)}
        <Text size="sm" c="dimmed">
          {backup.kind === "nightly"
            ? t("administration:backups.automatic")
            : t("administration:backups.manual")}
        </Text>
      </>
    ),
  },
  {
    key: "tried",
    head: t("administration:backups.tried"),
    value: (backup) => [verificationText(backup), auditText(backup)].filter(Boolean).join(" "),
    cell: (backup) => (
      <>
        {verificationText(backup)}
        <Text size="sm" {...(backup.audit_problem ? { fw: 600 } : { c: "dimmed" })}>
          {auditText(backup)}
        </Text>
      </>
    ),
  },
  {
    key: "size",
    onWide: true,
    head: t("administration:backups.size"),
    right: true,
    value: (backup) => (backup.problem ? null : toMegabytes(backup.bytes)),
    cell: (backup) => (backup.problem ? "–" : toMegabytes(backup.bytes).toFixed(1)),
  },
  {
    key: "file",
    head: t("administration:backups.file"),
    value: ({ file }) => file || null,
    cell: (backup) => (
      <>
        <Text size="sm" style={{ overflowWrap: "anywhere" }}>
          {backup.file}
        </Text>
        {backup.file && !backup.there && (
          <Badge color="gray" tt="none">
            {t("administration:backups.notHere")}
          </Badge>
        )}
      </>
    ),
  },
];

function verificationText(backup: Backup): string {
  if (backup.problem) return t("administration:backups.failed", { problem: backup.problem });
  if (backup.failure) return t("administration:backups.testFailed", { problem: backup.failure });
  if (backup.test_problem) return t("administration:backups.notVerified", { problem: backup.test_problem });
  if (!backup.tested_at) return t("administration:backups.notTried");
  return t("administration:backups.verified", { moment: formatMoment(backup.tested_at) });
}

/** Return in words whether the restored audit trail was intact, or null without a test. */
function auditText(backup: Backup): string | null {
  if (backup.audit_rows === null) return null;
  return backup.audit_problem
    ? t("administration:backups.auditBroken", { problem: backup.audit_problem })
    : t("administration:backups.auditWhole", { rows: backup.audit_rows });
}

/** Return the size in MB, rounded up to 0.1 MB. */
const toMegabytes = (bytes: number): number => Math.ceil(bytes / 100_000) / 10;
