import { Button, Card, Group, SegmentedControl, SimpleGrid, Stack, Text, Title } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { useQuery } from "@tanstack/react-query";
import { useNavigate, useSearch } from "@tanstack/react-router";
import type { ReactNode } from "react";
import { api, type Schemas } from "../../lib/api/client";
import { formatDayOf, formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { ASSESSMENT_FORM } from "../../lib/patientQueries";
import { ButtonLink, PageLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import { useOnTelephone } from "../../ui/useOnTelephone";
import { spadiLimits } from "../assessments/spadiMeaning";
import { useHasPermission, useMayOperate, useUserName } from "../auth/hooks";
import { OpenMark } from "../sessions/OpenMark";
import { ChangeLine } from "./ChangeLine";
import classes from "./home.module.css";

const REFETCH_MS = 60_000;
const FEW = 6;

/**
 * The work of the day: patients who are due, today's sessions, notes to sign, and changes of the user's
 * patients.
 */
export function Worklist() {
  const work = useQuery({ queryKey: ["worklist"], queryFn: api.worklist, refetchInterval: REFETCH_MS });
  const writes = useHasPermission("write_records");
  const onTelephone = useOnTelephone();
  if (!work.data) return <ProblemNote error={work.error} />;
  const { sessions, due, unsigned, changes } = work.data;
  const today = (
    <Part
      title={t("home:today")}
      none={t("home:todayNone")}
      more={<PageLink to="/sessions">{t("home:allSessions")}</PageLink>}
      items={sessions.map((session) => <SessionLine key={session.id} session={session} />)}
    />
  );
  // On a telephone the due patients take the whole screen, and an open session would not be seen.
  const todayFirst = onTelephone && sessions.some((session) => session.ended_at === null);
  return (
    <Stack>
      <ProblemNote error={work.error} />
      {todayFirst && today}
      <Due due={due} count={work.data.due_count} />
      <SimpleGrid cols={{ base: 1, sm: 2 }} className={classes.parts ?? ""}>
        {!todayFirst && today}
        {writes && (
          <Part
            title={t("home:unsigned")}
            none={t("home:unsignedNone")}
            items={unsigned.map((session) => <SessionLine key={session.id} session={session} />)}
          />
        )}
        {writes && <Changes changes={changes} />}
      </SimpleGrid>
    </Stack>
  );
}

function Changes({ changes }: { changes: Schemas["PatientChange"][] }) {
  const form = useQuery(ASSESSMENT_FORM).data;
  return (
    <Part
      title={t("home:changes")}
      hint={[t("home:changesExplained"), ...(form ? [t("home:changesLimits", spadiLimits(form))] : [])].join(
        " ",
      )}
      none={t("home:changesNone")}
      items={changes.map((change) => (
        <ChangeLine key={`${change.patient.id} ${change.side} ${change.measure}`} change={change} />
      ))}
    />
  );
}

function Due({ due, count }: { due: Schemas["DuePatient"][]; count: number }) {
  const navigate = useNavigate({ from: "/" });
  const { whose } = useSearch({ from: "/" });
  const name = useUserName();
  const shown = whose === "mine" ? due.filter((patient) => patient.therapist === name) : due;
  return (
    <Part
      id="due"
      title={t("home:due", { count: whose === "mine" ? shown.length : count })}
      hint={[
        t("home:dueExplained"),
        ...(count > due.length ? [t("home:dueFirst", { count: due.length })] : []),
      ].join(" ")}
      none={t("home:dueNone")}
      more={
        <SegmentedControl
          aria-label={t("home:whose")}
          value={whose ?? "all"}
          onChange={(value) =>
            void navigate({ search: value === "mine" ? { whose: "mine" } : {}, replace: true })
          }
          data={(["all", "mine"] as const).map((value) => ({ value, label: t(`home:${value}`) }))}
        />
      }
      items={shown.map((patient) => <DueLine key={patient.patient.id} due={patient} />)}
    />
  );
}

function DueLine({ due }: { due: Schemas["DuePatient"] }) {
  const operates = useMayOperate();
  const { patient, last_session_at: last, therapist } = due;
  const today = formatDayOf(due.due_at) === formatDayOf(new Date().toISOString());
  const day = last === null ? "" : formatDayOf(last);
  const came = therapist ? t("home:lastCame", { day, therapist }) : t("home:lastCameAlone", { day });
  return (
    <li className={classes.line ?? ""} data-testid="due">
      <div>
        <PatientLink patient={patient} />
        <Text size="sm">
          {last === null ? t("home:neverCame") : came}
          {" · "}
          {t("home:perWeek", { count: due.sessions_per_week })}
        </Text>
      </div>
      <Group gap="sm" wrap="nowrap">
        <Text size="sm" fw={600}>
          {today ? t("home:dueNow") : t("home:dueSince", { day: formatDayOf(due.due_at) })}
        </Text>
        {operates && (
          <ButtonLink
            to="/station"
            search={{ patient: patient.id }}
            variant="default"
            size="sm"
            className={classes.action ?? ""}
            aria-label={t("home:toStation", { name: patient.name })}
          >
            {t("common:shell.station")}
          </ButtonLink>
        )}
      </Group>
    </li>
  );
}

function SessionLine({ session }: { session: Schemas["SessionSummary"] }) {
  return (
    <li className={classes.line ?? ""}>
      <div>
        <PageLink to="/sessions/$sessionId" params={{ sessionId: session.id }}>
          {session.patient.name}
        </PageLink>
        <Text size="sm">
          {[formatMoment(session.started_at), session.station, session.therapist].filter(Boolean).join(" · ")}
        </Text>
      </div>
      <OpenMark session={session} />
    </li>
  );
}

function PatientLink({ patient }: { patient: Schemas["SessionPatient"] }) {
  return (
    <PageLink to="/patients/$patientId" params={{ patientId: patient.id }}>
      {patient.name}
    </PageLink>
  );
}

/** A list of the day. All rows of a long list are shown on request. */
function Part(props: {
  id?: string;
  title: string;
  none: string;
  items: ReactNode[];
  hint?: string;
  more?: ReactNode;
}) {
  const { id, title, none, items, hint, more } = props;
  const [whole, { toggle }] = useDisclosure(false);
  return (
    <Card withBorder component="section" aria-label={title} {...(id && { id })}>
      <Stack gap="xs">
        <Group justify="space-between" align="baseline">
          <Title order={2} size="h4">
            {title}
          </Title>
          {more}
        </Group>
        {hint && (
          <Text size="sm" c="dimmed">
            {hint}
          </Text>
        )}
        {items.length === 0 ? (
          <Text>{none}</Text>
        ) : (
          <ul className={classes.list ?? ""}>{whole ? items : items.slice(0, FEW)}</ul>
        )}
        {items.length > FEW && (
          <Button variant="subtle" onClick={toggle} aria-expanded={whole}>
            {whole ? t("home:showFewer") : t("home:showAll", { count: items.length })}
          </Button>
        )}
      </Stack>
    </Card>
  );
}
