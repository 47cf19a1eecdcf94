import "./catalogue";
import { Badge, Group, Stack, Text, Title } from "@mantine/core";
import { IconPlus } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import type { Schemas } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { adherenceOf, programmesOf } from "../../lib/patientQueries";
import { DataTable } from "../../ui/DataTable";
import { ButtonLink, PageLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import type { Column } from "../../ui/tableRows";
import { RequirePermission } from "../auth/RequirePermission";
import { describePrescription, describeVersion } from "./describeProgramme";
import { EndRangeAdherence } from "./EndRangeAdherence";

/** A patient's programmes with their current versions. */
export function Programmes({ patientId }: { patientId: string }) {
  const programmes = useQuery(programmesOf(patientId));
  const items = programmes.data?.items ?? [];
  const present = items.find((programme) => !programme.archived_at);
  return (
    <Stack gap="xs" component="section" aria-label={t("programmes:programme.programmes")}>
      <Group justify="space-between">
        <Title order={2} size="h3">
          {t("programmes:programme.programmes")}
        </Title>
        <RequirePermission permission="write_records">
          <ButtonLink
            to="/patients/$patientId/programmes/new"
            params={{ patientId }}
            variant="default"
            leftSection={<IconPlus size={20} />}
          >
            {t("programmes:new.title")}
          </ButtonLink>
        </RequirePermission>
      </Group>
      <ProblemNote error={programmes.error} />
      {programmes.data && items.length === 0 && <Text>{t("programmes:programme.none")}</Text>}
      {present && <Regularity episodeId={present.episode_id} />}
      {items.length > 0 && (
        <DataTable
          name="programmes"
          label={t("programmes:programme.programmes")}
          columns={COLUMNS}
          rows={items}
          rowKey={({ id }) => id}
          isDimmed={({ archived_at }) => archived_at !== null}
        />
      )}
    </Stack>
  );
}

const COLUMNS: Column<Schemas["Programme"]>[] = [
  {
    key: "name",
    head: t("programmes:programme.nameColumn"),
    always: true,
    value: ({ name }) => name,
    cell: (programme) => (
      <>
        <PageLink to="/programmes/$programmeId" params={{ programmeId: programme.id }}>
          {programme.name}
        </PageLink>
        {programme.archived_at && (
          <Badge ml="xs" color="gray">
            {t("programmes:programme.archived")}
          </Badge>
        )}
      </>
    ),
  },
  {
    key: "contents",
    head: t("programmes:programme.contents"),
    value: ({ current }) => [...current.items.map(itemLine), describeVersion(current)].join("\n"),
    cell: ({ current }) => (
      <>
        {current.items.map((item) => (
          <Text key={item.position}>{itemLine(item)}</Text>
        ))}
        <Text size="sm" c="dimmed">
          {describeVersion(current)}
        </Text>
      </>
    ),
  },
  {
    key: "since",
    head: t("programmes:programme.since"),
    value: ({ current }) => current.made_at,
    cell: ({ current }) => (
      <>
        {t("programmes:versions.since", { number: current.number, moment: formatMoment(current.made_at) })}
        <Text size="sm" c="dimmed">
          {current.made_by}
        </Text>
      </>
    ),
  },
];

/** Return in words what an item plays. */
function itemLine(item: Schemas["ProgrammeItem"]): string {
  return t(item.recording_archived ? "programmes:programme.itemArchived" : "programmes:programme.item", {
    recording: item.recording_name,
    played: describePrescription(item),
  });
}

/** Query the weeks of an episode with the sessions held and prescribed, oldest first. */
export function useAdherence(episodeId: string) {
  return useQuery(adherenceOf(episodeId));
}

/** Compares the sessions of this and last week with the prescribed number, and the end-range time. */
export function Regularity({ episodeId }: { episodeId: string }) {
  const adherence = useAdherence(episodeId);
  const weeks = adherence.data?.weeks ?? [];
  const [now, before] = [...weeks].reverse();
  return (
    <>
      {now && now.sessions_prescribed !== null && (
        <Text data-testid="regularity">
          {before
            ? t("programmes:regularity.nowAndBefore", {
                week: describeWeek(weekOf(now)),
                before: describeWeek(weekOf(before)),
              })
            : t("programmes:regularity.now", { week: describeWeek(weekOf(now)) })}
        </Text>
      )}
      <EndRangeAdherence weeks={weeks} />
    </>
  );
}

const weekOf = (week: Schemas["AdherenceWeek"]) => ({
  sessions: week.sessions,
  wished: week.sessions_prescribed,
  planned: week.repetitions_planned,
  done: week.repetitions_done,
});

/** Return in words how the sessions of a week compare with the prescribed number. */
function describeWeek(week: {
  sessions: number;
  wished: number | null;
  planned: number;
  done: number;
}): string {
  const { sessions, wished, planned, done } = week;
  const held =
    wished === null
      ? t("programmes:regularity.sessions", { count: sessions })
      : t("programmes:regularity.ofGoal", { sessions, count: wished });
  return planned
    ? t("programmes:regularity.withRepetitions", { sessions: held, done, count: planned })
    : held;
}
