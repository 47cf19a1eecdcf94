import { Badge, Card, Group, Skeleton, Stack, Table, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useParams } from "@tanstack/react-router";
import { useTitle } from "../../app/title";
import { api, type Run } from "../../lib/api/client";
import { formatClock, formatDeg, formatList, formatMoment, formatRange } from "../../lib/format";
import { t } from "../../lib/i18n";
import { translateServerText } from "../../lib/serverText";
import { InlineSlot } from "../../ui/InlineSlot";
import { ButtonLink, PageLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import { RevealWhenLoaded } from "../../ui/RevealWhenLoaded";
import { SampleLinks } from "../import-export/SampleLinks";
import { PlannedAndDone } from "../programmes/PlannedAndDone";
import { ReportLinks } from "../reports/ReportLinks";
import { LOAD_LEVELS } from "../station/loadLevels";
import { settingsWords } from "../station/playSettingsModel";
import { NoteCard } from "./NoteCard";
import { RunFigures } from "./RunFigures";
import { SessionAlarms } from "./SessionAlarms";
import { SessionComparison } from "./SessionComparison";
import { SessionFacts } from "./SessionFacts";
import { Head, Row } from "./sessionRows";

/** One session: its runs and how closely they followed the teaching. */
export function SessionPage() {
  const { sessionId } = useParams({ from: "/sessions/$sessionId" });
  const session = useQuery({ queryKey: ["session", sessionId], queryFn: () => api.session(sessionId) });
  useTitle(
    session.data
      ? t("sessions:session.ofPatient", { patient: session.data.patient.name })
      : t("sessions:session.title"),
  );
  if (session.error) return <ProblemNote error={session.error} />;
  if (!session.data) return <Skeleton h={300} />;
  const { data } = session;
  return (
    <RevealWhenLoaded>
      <Stack>
        <Group justify="space-between" align="start">
          <div>
            <Title order={1} size="h2">
              <InlineSlot words={(patient) => t("sessions:session.ofPatient", { patient })}>
                <PageLink inherit to="/patients/$patientId" params={{ patientId: data.patient.id }}>
                  {data.patient.name}
                </PageLink>
              </InlineSlot>
            </Title>
            <Text>
              {data.ended_at
                ? t("sessions:session.fromTo", {
                    from: formatMoment(data.started_at),
                    to: formatMoment(data.ended_at),
                  })
                : t("sessions:session.stillOpen", { from: formatMoment(data.started_at) })}
            </Text>
          </div>
          {!data.ended_at && (
            <Group>
              <ButtonLink to="/" search={{ patient: data.patient.id }} variant="default">
                {t("sessions:session.toStation")}
              </ButtonLink>
            </Group>
          )}
        </Group>
        <SessionFacts session={data} />
        <ReportLinks of="sessions" id={data.id} />
        <PlannedAndDone sessionId={data.id} />
        <NoteCard key={data.id} session={data} />
        <SessionAlarms sessionId={data.id} />
        <SessionComparison key={`comparison ${data.id}`} session={data} />
        {data.runs.length === 0 && <Text>{t("sessions:session.nothingPlayed")}</Text>}
        {data.runs.map((run, place) => (
          <RunCard key={run.id} run={run} number={place + 1} />
        ))}
      </Stack>
    </RevealWhenLoaded>
  );
}

function RunCard({ run, number }: { run: Run; number: number }) {
  const changes = settingsWords(run);
  return (
    <Card withBorder padding="lg" component="section" aria-label={t("sessions:session.playback", { number })}>
      <Stack>
        <Group justify="space-between">
          <Title order={2} size="h3">
            <InlineSlot words={(recording) => t("sessions:session.numbered", { number, recording })}>
              <PageLink inherit to="/recordings/$recordingId" params={{ recordingId: run.recording_id }}>
                {run.recording_name}
              </PageLink>
            </InlineSlot>
          </Title>
          <Group>
            <Text>{formatClock(new Date(run.started_at))}</Text>
            <Badge
              size="lg"
              variant="light"
              color={run.outcome === "completed" ? "indigo" : "grape"}
              tt="none"
            >
              {t(`sessions:outcomes.${run.outcome}`)}
            </Badge>
          </Group>
        </Group>
        {run.load_level !== null && (
          <Text c="dimmed">{t("sessions:session.level", { level: run.load_level, most: LOAD_LEVELS })}</Text>
        )}
        {changes && <Text>{changes}</Text>}
        <Text data-testid="done">{doneWords(run)}</Text>
        {run.stop && <Text fw={600}>{translateServerText(run.stop.message, run.stop.message_key)}</Text>}
        {run.comparison ? (
          <>
            <Group justify="end">
              <SampleLinks of="runs" id={run.id} />
            </Group>
            <MotorErrors run={run} comparison={run.comparison} />
            <MotionErrors motions={run.comparison.motions} />
            <RunFigures runId={run.id} length_s={run.rate_hz ? run.comparison.samples / run.rate_hz : null} />
          </>
        ) : (
          <Text>{t("sessions:session.nothingToCompare")}</Text>
        )}
      </Stack>
    </Card>
  );
}

/** Describe how much was played and what interrupted it. */
function doneWords(run: Run): string {
  const words: string[] = [];
  if (run.repetitions_done !== null) {
    words.push(t("sessions:session.repetitions", { done: run.repetitions_done, planned: run.repetitions }));
  }
  if (run.reversals) words.push(t("sessions:session.reversals", { count: run.reversals }));
  if (run.least_range_percent !== null)
    words.push(t("sessions:session.smallestRange", { percent: run.least_range_percent }));
  return formatList(words);
}

type Comparison = NonNullable<Run["comparison"]>;

function MotorErrors({ run, comparison }: { run: Run; comparison: Comparison }) {
  return (
    <Table.ScrollContainer minWidth={860}>
      <Table withTableBorder verticalSpacing="xs" data-testid="errors">
        <Table.Caption>
          {run.rate_hz
            ? t("sessions:compared.captionAt", { samples: comparison.samples, hz: run.rate_hz })
            : t("sessions:compared.caption", { samples: comparison.samples })}
        </Table.Caption>
        <Head
          first={t("sessions:compared.motor")}
          others={[
            ...t("sessions:compared.heads", { returnObjects: true }),
            ...t("sessions:compared.motorHeads", { returnObjects: true }),
          ]}
        />
        <Table.Tbody>
          {comparison.motors.map((motor) => (
            <Row
              key={motor.motor}
              first={String(motor.motor)}
              others={[
                ...errorCells(motor),
                formatDeg(motor.torque_peak_nm, 2),
                formatDeg(motor.taught_smoothness, 2),
                formatDeg(motor.played_smoothness, 2),
              ]}
            />
          ))}
        </Table.Tbody>
      </Table>
    </Table.ScrollContainer>
  );
}

/** The patient's motion compared with the apparatus's range and a healthy shoulder. */
function MotionErrors({ motions }: { motions: Comparison["motions"] }) {
  if (motions.length === 0) return null;
  return (
    <Table.ScrollContainer minWidth={860}>
      <Table withTableBorder verticalSpacing="xs" data-testid="motions">
        <Table.Caption>{t("sessions:compared.motionsCaption")}</Table.Caption>
        <Head
          first={t("sessions:compared.motion")}
          others={[
            ...t("sessions:compared.heads", { returnObjects: true }),
            ...t("sessions:compared.motionHeads", { returnObjects: true }),
          ]}
        />
        <Table.Tbody>
          {motions.map((motion) => (
            <Row
              key={motion.motion}
              first={t("sessions:compared.motionNamed", {
                number: motion.motion,
                name: translateServerText(motion.name, motion.name_key),
              })}
              others={[
                ...errorCells(motion),
                formatRange(motion.apparatus_min_deg, motion.apparatus_max_deg),
                formatRange(motion.reference_min_deg, motion.reference_max_deg),
              ]}
            />
          ))}
        </Table.Tbody>
      </Table>
    </Table.ScrollContainer>
  );
}

function errorCells(compared: Comparison["motors"][number] | Comparison["motions"][number]): string[] {
  return [
    formatDeg(compared.peak_deg, 2),
    compared.peak_at_s.toFixed(1),
    formatDeg(compared.rmse_deg, 2),
    formatDeg(compared.start_deg, 2),
    formatDeg(compared.lag_ms, 0),
    formatRange(compared.taught_min_deg, compared.taught_max_deg),
    formatRange(compared.played_min_deg, compared.played_max_deg),
  ];
}
