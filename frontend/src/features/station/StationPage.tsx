import { Alert, Card, Stack, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useNavigate, useSearch } from "@tanstack/react-router";
import { useTitle } from "../../app/title";
import { api } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { useLive, useStation } from "../../lib/live/hooks";
import { useDatabaseUnavailable, useReadyPatients } from "../../lib/offline";
import { ProblemNote } from "../../ui/ProblemNote";
import { RevealWhenLoaded } from "../../ui/RevealWhenLoaded";
import { useHasPermission, useMayOperate, useMe, worksAt } from "../auth/hooks";
import { CommissioningState } from "../commissioning/CommissioningState";
import { LiveApparatus } from "../digital-twin/lazyViews";
import { PatientBanner } from "../patients/PatientBanner";
import { PatientSelect } from "../patients/PatientSelect";
import { LiveRhythm } from "../rhythm/lazyRhythm";
import { Angles } from "./Angles";
import { ApparatusSideCard } from "./ApparatusSideCard";
import { DriveHealth } from "./DriveHealth";
import { FirstSteps } from "./FirstSteps";
import { LeaseBar } from "./LeaseBar";
import { LoadedRun } from "./LoadedRun";
import { LoopHealth } from "./LoopHealth";
import { ReadySelect } from "./ReadySelect";
import { RecentEvents } from "./RecentEvents";
import { SimulatorPanel } from "./SimulatorPanel";
import classes from "./station.module.css";
import { WorkPanels } from "./WorkPanels";

/**
 * The therapist's page with patient, teaching, playback and the live apparatus. The simulated hand is below
 * them.
 */
export function StationPage() {
  const station = useStation();
  const diagnoses = useHasPermission("diagnose");
  const run = useLive("run");
  const teaching = useLive("teaching");
  const stop = useLive("stop");
  const canReadRecords = useHasPermission("read_records");
  const search = useSearch({ from: "/station" });
  // The patient on the apparatus takes precedence over the one in the address.
  const onApparatus = run?.patient ?? teaching?.patient;
  const patientId = onApparatus?.id ?? search.patient;
  const name = onApparatus?.name;
  const title = station?.name ?? t("station:station.title");
  useTitle(title);
  return (
    <Stack gap="sm">
      <Title order={1} className={classes.stationName ?? ""}>
        {title}
      </Title>
      {canReadRecords && patientId && <PatientBanner patientId={patientId} {...(name && { name })} />}
      <RevealWhenLoaded waits={!station} now={run !== null || teaching !== null || stop !== null}>
        <div className={classes.page} data-stopped={stop !== null}>
          {/* During a stop the panels are hidden instead of unmounted, so that input is not lost. */}
          <div hidden={stop !== null}>
            <Stack gap="xs">
              <PatientColumn />
            </Stack>
          </div>
          <div className={classes.liveArea}>
            <div className={classes.live}>
              <LiveApparatus />
              <Angles />
            </div>
          </div>
          {diagnoses && station?.simulated && <SimulatorPanel />}
          <Stack className={classes.facts ?? ""}>
            {canReadRecords && onApparatus && <LiveRhythm patientId={onApparatus.id} />}
            <CommissioningState link />
            <RecentEvents />
            <DriveHealth />
            <LoopHealth />
          </Stack>
        </div>
      </RevealWhenLoaded>
    </Stack>
  );
}

/** The patient with the panels for teaching and the session. */
function PatientColumn() {
  const station = useStation();
  const me = useMe();
  const canReadRecords = useHasPermission("read_records");
  const operates = useMayOperate();
  const search = useSearch({ from: "/station" });
  const run = useLive("run");
  const teaching = useLive("teaching");
  const navigate = useNavigate({ from: "/station" });
  const databaseUnavailable = useDatabaseUnavailable();
  // The patient on the apparatus takes precedence over the one in the address.
  const onApparatus = run?.patient?.id ?? teaching?.patient?.id;
  const patientId = onApparatus ?? search.patient ?? null;
  const patient = useQuery({
    queryKey: ["patient", patientId],
    queryFn: () => api.patient(patientId ?? ""),
    enabled: canReadRecords && patientId !== null && !databaseUnavailable,
  });
  const ready = useReadyPatients();
  const readyPatient = databaseUnavailable
    ? ready.data?.find((known) => known.patient.id === patientId)
    : undefined;
  const choose = (chosen: string | null) => void navigate({ search: chosen ? { patient: chosen } : {} });
  return (
    <>
      {station?.simulated && canReadRecords && operates && <FirstSteps patientId={patientId} />}
      <LeaseBar />
      {me && station && !worksAt(me, station.name) && (
        <Alert color="gray" variant="outline">
          {t("station:station.notAssigned", { station: station.name })}
        </Alert>
      )}
      {canReadRecords && databaseUnavailable && (
        <ReadySelect chosen={patientId} disabled={onApparatus !== undefined} onChange={choose} />
      )}
      {/* The patient on the apparatus is in the banner and cannot be changed. */}
      {canReadRecords && !databaseUnavailable && !onApparatus && (
        <PatientSelect chosen={patient.data} onChange={choose} />
      )}
      {patient.data?.notes && (
        <Text size="sm" style={{ whiteSpace: "pre-wrap" }}>
          {patient.data.notes}
        </Text>
      )}
      {!databaseUnavailable && <ProblemNote error={patient.error} />}
      {!run && !teaching && (
        <ApparatusSideCard wanted={patient.data?.affected_side ?? readyPatient?.side ?? undefined} />
      )}
      {operates && patientId && (
        <WorkPanels key={patientId} patientId={patientId} wanted={search.recording ?? null} />
      )}
      {!operates && run && (
        <Card withBorder component="section" aria-label={t("station:station.currentPlayback")}>
          <LoadedRun run={run} />
        </Card>
      )}
    </>
  );
}
