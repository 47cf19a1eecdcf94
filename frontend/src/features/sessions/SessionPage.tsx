import { Badge, Group, SegmentedControl, Skeleton, Stack, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useNavigate, useParams, useSearch } from "@tanstack/react-router";
import { useTitle } from "../../app/title";
import { api, type Session } from "../../lib/api/client";
import { formatAfter, formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { ButtonLink } from "../../ui/links";
import { PageTabs } from "../../ui/PageTabs";
import { ProblemNote } from "../../ui/ProblemNote";
import { RenderInSteps } from "../../ui/RenderInSteps";
import { RevealWhenLoaded } from "../../ui/RevealWhenLoaded";
import { SimulatedBadge } from "../../ui/SimulatedBadge";
import { RunPlayback } from "../digital-twin/lazyViews";
import { PatientBanner } from "../patients/PatientBanner";
import { PlannedAndDone } from "../programmes/PlannedAndDone";
import { ReportLinks } from "../reports/ReportLinks";
import { RunRhythm } from "../rhythm/lazyRhythm";
import { GoniometerCard } from "./GoniometerCard";
import { NoteCard } from "./NoteCard";
import { RunCard } from "./RunCard";
import { RunNumbers } from "./RunNumbers";
import { SessionAlarms } from "./SessionAlarms";
import { SessionComparison } from "./SessionComparison";
import { SessionFacts } from "./SessionFacts";
import { ResultMetrics, Verdict } from "./SessionResult";
import { SessionTimeline } from "./SessionTimeline";
import classes from "./sessions.module.css";
import { readSessionView, type SessionTab } from "./sessionTabs";

/** One session: how it went, then its playbacks, numbers and record in tabs. */
export function SessionPage() {
  const { sessionId } = useParams({ from: "/sessions/$sessionId" });
  const session = useQuery({ queryKey: ["session", sessionId], queryFn: () => api.session(sessionId) });
  useTitle(
    session.data
      ? t("sessions:session.ofPatient", { patient: session.data.patient.name })
      : t("sessions:session.title"),
  );
  if (session.error) return <ProblemNote error={session.error} />;
  const waiting = <Skeleton h={300} />;
  if (!session.data) return waiting;
  return (
    <RenderInSteps meanwhile={waiting}>
      <RevealWhenLoaded>
        <SessionView session={session.data} />
      </RevealWhenLoaded>
    </RenderInSteps>
  );
}

function SessionView({ session }: { session: Session }) {
  const { tab = "playback", run = 1 } = useSearch({ from: "/sessions/$sessionId" });
  const navigate = useNavigate({ from: "/sessions/$sessionId" });
  const runIndex = Math.min(run, session.runs.length) - 1;
  const open = (next: SessionTab) =>
    void navigate({ search: (before) => readSessionView({ ...before, tab: next }) });
  return (
    <Stack gap="sm">
      <PatientBanner patientId={session.patient.id} name={session.patient.name} link />
      <Heading session={session} />
      <ResultMetrics session={session} />
      <SessionTimeline session={session} chosen={runIndex} />
      <PageTabs
        label={t("sessions:session.title")}
        value={tab}
        names={t("sessions:tabs", { returnObjects: true })}
        onChange={open}
      >
        {(shown) => (
          <Stack>
            {PER_PLAYBACK.includes(shown) && <PlaybackPicker session={session} runIndex={runIndex} />}
            <TabContent session={session} tab={shown} runIndex={runIndex} />
          </Stack>
        )}
      </PageTabs>
    </Stack>
  );
}

/** The tabs that show one playback. */
const PER_PLAYBACK: SessionTab[] = ["playback", "motion", "rhythm", "numbers"];

function TabContent({ session, tab, runIndex }: { session: Session; tab: SessionTab; runIndex: number }) {
  const run = session.runs[runIndex];
  if (PER_PLAYBACK.includes(tab) && !run) return <Text>{t("sessions:session.nothingPlayed")}</Text>;
  switch (tab) {
    case "playback":
      return run && <RunCard run={run} number={runIndex + 1} />;
    case "motion":
      return run && <RunPlayback key={run.id} runId={run.id} />;
    case "rhythm":
      return run && <RunRhythm key={run.id} runId={run.id} />;
    case "numbers":
      return run && <RunNumbers run={run} number={runIndex + 1} />;
    case "goniometer":
      return <GoniometerCard session={session} />;
    case "plan":
      return session.programme ? (
        <PlannedAndDone sessionId={session.id} />
      ) : (
        <Text>{t("sessions:facts.noProgramme")}</Text>
      );
    case "compare":
      return <SessionComparison key={session.id} session={session} />;
    case "record":
      return (
        <>
          <NoteCard key={session.id} session={session} />
          <SessionFacts session={session} />
          <SessionAlarms sessionId={session.id} />
          <ReportLinks of="sessions" id={session.id} />
        </>
      );
  }
}

/** Chooses the playback that the tabs show. */
function PlaybackPicker({ session, runIndex }: { session: Session; runIndex: number }) {
  const navigate = useNavigate({ from: "/sessions/$sessionId" });
  if (session.runs.length < 2) return null;
  return (
    <div className={classes.runs}>
      <SegmentedControl
        size="md"
        aria-label={t("sessions:session.chosen")}
        value={String(runIndex + 1)}
        onChange={(chosen) =>
          void navigate({ search: (before) => ({ ...before, run: Number(chosen) }), replace: true })
        }
        data={session.runs.map((run, n) => ({
          value: String(n + 1),
          label: t("sessions:session.numbered", { number: n + 1, recording: run.recording_name }),
        }))}
      />
    </div>
  );
}

/** Shows the time, the therapist, how the session went, and whether the note is signed. */
function Heading({ session }: { session: Session }) {
  const { patient, started_at, ended_at } = session;
  return (
    <Group justify="space-between" align="start" gap="xs">
      <div>
        <Group gap="xs">
          <Title order={1} size="h2">
            {t("sessions:session.title")}
          </Title>
          <SimulatedBadge simulated={session.simulated} />
          {!session.signed_at && (
            <Badge size="lg" variant="outline" color="gray" tt="none">
              {t("sessions:sessions.notSigned")}
            </Badge>
          )}
        </Group>
        <Text>
          {ended_at
            ? t("sessions:session.fromTo", {
                from: formatMoment(started_at),
                to: formatAfter(ended_at, started_at),
              })
            : t("sessions:session.stillOpen", { from: formatMoment(started_at) })}
          {session.therapist && t("sessions:session.by", { therapist: session.therapist })}
        </Text>
      </div>
      <Group>
        <Verdict session={session} />
        {!ended_at && (
          <ButtonLink to="/station" search={{ patient: patient.id }} variant="default">
            {t("sessions:session.toStation")}
          </ButtonLink>
        )}
      </Group>
    </Group>
  );
}
