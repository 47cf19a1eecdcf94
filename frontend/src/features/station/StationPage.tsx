import { Alert, Box, Card, Grid, Stack, Text, Title } from "@mantine/core";
import { IconAlertTriangle } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useNavigate, useSearch } from "@tanstack/react-router";
import { startTransition, useEffect, useState } from "react";
import { useTitle } from "../../app/title";
import { api, type Patient } from "../../lib/api/client";
import { sideWord } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useLive, useStation } from "../../lib/live/hooks";
import { useDatabaseUnavailable, useReadyPatients } from "../../lib/offline";
import { useEpisodes } from "../../lib/patientQueries";
import { StopBanner } from "../../safety/StopBanner";
import { ProblemNote } from "../../ui/ProblemNote";
import { RevealWhenLoaded } from "../../ui/RevealWhenLoaded";
import { useHasPermission, useMayOperate, useMe, worksAt } from "../auth/hooks";
import { LiveApparatus } from "../digital-twin/lazyViews";
import { PatientSelect } from "../patients/PatientSelect";
import { Angles } from "./Angles";
import { ApparatusSideCard } from "./ApparatusSideCard";
import { LeaseBar } from "./LeaseBar";
import { LoopHealth } from "./LoopHealth";
import { ReadySelect } from "./ReadySelect";
import { RecentEvents } from "./RecentEvents";

type Panels = typeof import("./lazyStationPanels");

/**
 * Load the station's panels after the first page, which already shows the state and Stop. Null until loaded.
 */
function useLazyPanels() {
  const [panels, setPanels] = useState<Panels | null>(null);
  useEffect(() => {
    import("./lazyStationPanels").then(
      (loaded) => startTransition(() => setPanels(loaded)),
      (error: unknown) =>
        setPanels(() => {
          throw error;
        }),
    );
  }, []);
  return panels;
}

/** The therapist's page: patient, teaching, playback and the live apparatus. */
export function StationPage() {
  const station = useStation();
  const diagnoses = useHasPermission("diagnose");
  const run = useLive("run");
  const teaching = useLive("teaching");
  const stop = useLive("stop");
  const panels = useLazyPanels();
  const title = station?.name ?? t("station:station.title");
  useTitle(title);
  return (
    <Stack>
      <Title order={1} size="h2" style={{ position: "absolute", left: -9999 }}>
        {title}
      </Title>
      <StopBanner fullPage />
      <RevealWhenLoaded waits={!station || !panels} now={run !== null || teaching !== null || stop !== null}>
        <Grid gap="lg">
          <Grid.Col span={{ base: 12, md: 6 }}>
            {/* Hidden instead of unmounted during a stop, so that input is not lost. */}
            <Stack hidden={stop !== null} display={stop === null ? "flex" : "none"}>
              <PatientColumn panels={panels} />
            </Stack>
            {panels && diagnoses && station?.simulated && (
              <Box mt={stop === null ? "md" : 0}>
                <panels.SimulatorPanel />
              </Box>
            )}
          </Grid.Col>
          <Grid.Col span={{ base: 12, md: 6 }}>
            <Stack>
              <LiveApparatus />
              <Angles />
              <RecentEvents />
              <LoopHealth />
            </Stack>
          </Grid.Col>
        </Grid>
      </RevealWhenLoaded>
    </Stack>
  );
}

/** The patient with the panels for teaching and the session. */
function PatientColumn({ panels }: { panels: Panels | null }) {
  const station = useStation();
  const me = useMe();
  const reads = useHasPermission("read_records");
  const operates = useMayOperate();
  const search = useSearch({ from: "/" });
  const run = useLive("run");
  const teaching = useLive("teaching");
  const navigate = useNavigate({ from: "/" });
  const databaseUnavailable = useDatabaseUnavailable();
  // The patient on the apparatus takes precedence over the one in the address.
  const onApparatus = run?.patient?.id ?? teaching?.patient?.id;
  const patientId = onApparatus ?? search.patient ?? null;
  const patient = useQuery({
    queryKey: ["patient", patientId],
    queryFn: () => api.patient(patientId ?? ""),
    enabled: reads && patientId !== null && !databaseUnavailable,
  });
  const ready = useReadyPatients();
  const readyPatient = databaseUnavailable
    ? ready.data?.find((known) => known.patient.id === patientId)
    : undefined;
  const choose = (chosen: string | null) => void navigate({ search: chosen ? { patient: chosen } : {} });
  const choice = { disabled: onApparatus !== undefined, onChange: choose };
  return (
    <>
      {panels && station?.simulated && reads && operates && <panels.FirstSteps patientId={patientId} />}
      <LeaseBar />
      {me && station && !worksAt(me, station.name) && (
        <Alert color="gray" variant="outline">
          {t("station:station.notAssigned", { station: station.name })}
        </Alert>
      )}
      {reads &&
        (databaseUnavailable ? (
          <ReadySelect chosen={patientId} {...choice} />
        ) : (
          <PatientSelect chosen={patient.data} {...choice} />
        ))}
      {patient.data && <Text>{patientWords(patient.data)}</Text>}
      {reads && !databaseUnavailable && patientId && <Contraindications patientId={patientId} />}
      {!databaseUnavailable && <ProblemNote error={patient.error} />}
      <ApparatusSideCard wanted={patient.data?.affected_side ?? readyPatient?.side ?? undefined} />
      {/* A panel whose action is impossible now is replaced by the current activity. */}
      {panels && operates && patientId && !run && (
        <panels.TeachPanel key={`teach ${patientId}`} patientId={patientId} />
      )}
      {panels && operates && patientId && !teaching && (
        <panels.SessionWizard key={patientId} patientId={patientId} wanted={search.recording ?? null} />
      )}
      {panels && !operates && run && (
        <Card withBorder component="section" aria-label={t("station:station.currentPlayback")}>
          <panels.LoadedRun run={run} />
        </Card>
      )}
    </>
  );
}

/** Contraindications of the open episodes, shown before teaching and playback. */
function Contraindications({ patientId }: { patientId: string }) {
  const episodes = useEpisodes(patientId);
  const contraindicated = (episodes.data?.items ?? []).filter(
    (episode) => episode.closed_at === null && episode.contraindications,
  );
  return contraindicated.map((episode) => (
    <Alert
      key={episode.id}
      color="gray"
      variant="outline"
      icon={<IconAlertTriangle />}
      title={t(`station:station.contraindications.${episode.side}`)}
      data-testid="contraindications"
    >
      <Text fw={600} style={{ whiteSpace: "pre-wrap" }}>
        {episode.contraindications}
      </Text>
    </Alert>
  ));
}

function patientWords({ affected_side, notes }: Patient): string {
  const shoulder = affected_side === null ? sideWord(null) : t(`station:station.shoulder.${affected_side}`);
  return notes ? t("station:station.shoulderNotes", { shoulder, notes }) : shoulder;
}
