import "./catalogue";
import { Button, Group, Stack, Table, Text } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { IconTable } from "@tabler/icons-react";
import type { Schemas } from "../../lib/api/client";
import { countedSeconds, formatDay, formatDuration, formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { translateServerText } from "../../lib/serverText";
import { PageLink } from "../../ui/links";

type Week = Schemas["AdherenceWeek"];
type Done = Schemas["EndRangeDone"];

/** Compares the counted end-range time of this week with the prescribed one. A table has all weeks and sessions. */
export function EndRangeAdherence({ weeks }: { weeks: Week[] }) {
  const [shown, table] = useDisclosure(false);
  const counted = weeks.filter((week) => week.end_range.length > 0).reverse();
  const [newest] = counted;
  if (!newest) return null;
  const present = newest === weeks.at(-1);
  return (
    <Stack gap="xs" align="start">
      <Group>
        <Text data-testid="end-range">
          {t(present ? "programmes:endRange.thisWeek" : "programmes:endRange.inWeek", {
            day: formatDay(newest.begins_on),
            motions: newest.end_range.map(describeMotionTime),
          })}
        </Text>
        <Button
          variant="default"
          leftSection={<IconTable size={20} />}
          aria-expanded={shown}
          onClick={table.toggle}
        >
          {t(shown ? "programmes:endRange.hideTable" : "programmes:endRange.showTable")}
        </Button>
      </Group>
      {shown && <WeeksTable weeks={counted} />}
    </Stack>
  );
}

function WeeksTable({ weeks }: { weeks: Week[] }) {
  return (
    <Table withTableBorder verticalSpacing="xs" aria-label={t("programmes:endRange.title")}>
      <Table.Thead>
        <Table.Tr>
          <Table.Th scope="col">{t("programmes:endRange.period")}</Table.Th>
          <Table.Th scope="col">{t("programmes:endRange.motion")}</Table.Th>
          <Table.Th scope="col" ta="right">
            {t("programmes:endRange.counted")}
          </Table.Th>
          <Table.Th scope="col" ta="right">
            {t("programmes:endRange.prescribed")}
          </Table.Th>
        </Table.Tr>
      </Table.Thead>
      <Table.Tbody>
        {weeks.flatMap((week) => [
          ...week.end_range.map((done) => (
            <DoneRow key={`${week.begins_on} ${done.motion}`} done={done} bold>
              {t("programmes:endRange.week", { day: formatDay(week.begins_on) })}
            </DoneRow>
          )),
          ...week.end_range_sessions.toReversed().flatMap((session) =>
            session.motions.map((done) => (
              <DoneRow key={`${session.session_id} ${done.motion}`} done={done}>
                <PageLink to="/sessions/$sessionId" params={{ sessionId: session.session_id }}>
                  {formatMoment(session.started_at)}
                </PageLink>
              </DoneRow>
            )),
          ),
        ])}
      </Table.Tbody>
    </Table>
  );
}

function DoneRow(props: { done: Done; bold?: boolean; children: React.ReactNode }) {
  const { done, bold = false } = props;
  return (
    <Table.Tr {...(bold && { fw: 600 })}>
      <Table.Td>{props.children}</Table.Td>
      <Table.Td>{translateServerText(done.name, done.name_key)}</Table.Td>
      <Table.Td ta="right">{describeTime(done.counted_s)}</Table.Td>
      <Table.Td ta="right">{describeTime(done.prescribed_s)}</Table.Td>
    </Table.Tr>
  );
}

/** Return a counted time in minutes and seconds. */
const describeTime = (seconds: number | null) =>
  seconds === null ? "–" : formatDuration(countedSeconds(seconds));

/** Return the counted time beside the prescribed one, in minutes and seconds. */
export const describeEndRangeTime = (counted_s: number | null, prescribed_s: number | null): string =>
  prescribed_s === null
    ? describeTime(counted_s)
    : t("programmes:endRange.of", { time: describeTime(counted_s), goal: formatDuration(prescribed_s) });

const describeMotionTime = (done: Done): string =>
  t("programmes:endRange.motionDone", {
    motion: translateServerText(done.name, done.name_key),
    time: describeEndRangeTime(done.counted_s, done.prescribed_s),
  });
