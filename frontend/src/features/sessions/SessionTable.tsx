import { Text } from "@mantine/core";
import type { Schemas } from "../../lib/api/client";
import { formatAfter, formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import type { SavedRows } from "../../lib/usePagedQuery";
import { DataTable } from "../../ui/DataTable";
import { PageLink } from "../../ui/links";
import { SimulatedBadge } from "../../ui/SimulatedBadge";
import type { Column } from "../../ui/tableRows";
import { OpenMark } from "./OpenMark";

type Session = Schemas["SessionSummary"];

/** A table of sessions, optionally with the patients' names. `more`: there are sessions that are not loaded yet. */
export function SessionTable(props: {
  items: Session[];
  withPatient?: boolean;
  narrowed?: boolean;
  more: boolean;
  fetchAll: () => Promise<SavedRows<Session>>;
}) {
  if (props.items.length === 0) {
    return <Text>{props.narrowed ? t("sessions:sessions.noneMatches") : t("sessions:sessions.none")}</Text>;
  }
  return (
    <DataTable
      name="sessions"
      label={t("sessions:sessions.title")}
      columns={
        props.withPatient
          ? [STARTED, PATIENT, ...AFTER_PATIENT, { ...ENDED, onWide: true }, SIGNED]
          : [STARTED, ...AFTER_PATIENT, ENDED, SIGNED]
      }
      rows={props.items}
      rowKey={({ id }) => id}
      rowName={({ patient, started_at }) => `${patient.name}, ${formatMoment(started_at)}`}
      more={props.more}
      fetchAll={props.fetchAll}
    />
  );
}

const STARTED: Column<Session> = {
  key: "started",
  head: t("sessions:sessions.started"),
  always: true,
  value: ({ started_at }) => started_at,
  cell: (session) => (
    <>
      {/* The day is on one line where the column is narrow. */}
      <PageLink
        to="/sessions/$sessionId"
        params={{ sessionId: session.id }}
        fz="sm"
        display="inline-block"
        miw="5.25rem"
      >
        {formatMoment(session.started_at)}
      </PageLink>{" "}
      <OpenMark session={session} />
    </>
  ),
};

const PATIENT: Column<Session> = {
  key: "patient",
  head: t("sessions:sessions.patient"),
  always: true,
  value: ({ patient }) => patient.name,
  cell: ({ patient }) => (
    <>
      <PageLink
        to="/patients/$patientId"
        params={{ patientId: patient.id }}
        style={{ overflowWrap: "anywhere" }}
      >
        {patient.name}
      </PageLink>{" "}
      <Text span size="sm" c="dimmed" style={{ whiteSpace: "nowrap" }}>
        {patient.clinic_number}
      </Text>
    </>
  ),
};

const AFTER_PATIENT: Column<Session>[] = [
  {
    key: "therapist",
    onWide: true,
    head: t("sessions:sessions.therapist"),
    value: ({ therapist }) => therapist || null,
    cell: ({ therapist }) => therapist || "–",
  },
  {
    key: "station",
    onWide: true,
    head: t("sessions:sessions.station"),
    value: ({ station }) => station || null,
    cell: ({ station, simulated }) => (
      <>
        {station || "–"} <SimulatedBadge simulated={simulated} short />
      </>
    ),
  },
  {
    key: "playbacks",
    onWide: true,
    head: t("sessions:sessions.playbacks"),
    right: true,
    total: true,
    value: ({ runs }) => runs,
    cell: ({ runs }) => runs,
  },
  {
    key: "stopped",
    head: t("sessions:sessions.stopped"),
    right: true,
    total: true,
    value: ({ stops }) => stops,
    cell: ({ stops }) => stops,
  },
];

/** Return a column of a time after the start. `without`: the words of a session that has none yet. */
const laterColumn = (key: "ended" | "signed", without: string): Column<Session> => ({
  key,
  head: t(`sessions:sessions.${key}`),
  value: (session) => session[`${key}_at`],
  cell: (session) => {
    const at = session[`${key}_at`];
    return at ? formatAfter(at, session.started_at) : without;
  },
});
const ENDED = laterColumn("ended", "–");
const SIGNED = laterColumn("signed", t("sessions:sessions.notSigned"));
