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

/**
 * Load the station's panels after the first page, which already shows the state and Stop. Null until loaded.
 */
function useWork() {
  const [work, setWork] = useState<typeof import("./lazyStationPanels") | null>(null);
  useEffect(() => {
    import("./lazyStationPanels").then(
      (loaded) => startTransition(() => setWork(loaded)),
      (error: unknown) =>
        setWork(() => {
          throw error;
        }),
    );
  }, []);
  return work;
}

/** The therapist's page: patient, teaching, playback and the live apparatus. */
export function StationPage() {
  const station = useStation();
  const me = useMe();
  const reads = useHasPermission("read_records");
  const operates = useMayOperate();
  const diagnoses = useHasPermission("diagnose");
  const search = useSearch({ from: "/" });
  const run = useLive("run");
  const teaching = useLive("teaching");
  const stop = useLive("stop");
  const navigate = useNavigate({ from: "/" });
  const work = useWork();
  useTitle(station?.name ?? t("station:station.title"));
  // The patient on the apparatus takes precedence over the one in the address.
  const away = useDatabaseUnavailable();
  const onApparatus = run?.patient?.id ?? teaching?.patient?.id;
  const patientId = onApparatus ?? search.patient ?? null;
  const patient = useQuery({
    queryKey: ["patient", patientId],
    queryFn: () => api.patient(patientId ?? ""),
    enabled: reads && patientId !== null && !away,
  });
  const ready = useReadyPatients();
  const kept = away ? ready.data?.find((one) => one.patient.id === patientId) : undefined;
  const choose = (chosen: string | null) => void navigate({ search: chosen ? { patient: chosen } : {} });
  return (
    <Stack>
      <Title order={1} size="h2" style={{ position: "absolute", left: -9999 }}>
        {station?.name ?? t("station:station.title")}
      </Title>
      <StopBanner fullPage />
      <RevealWhenLoaded waits={!station || !work} now={run !== null || teaching !== null || stop !== null}>
        <Grid gap="lg">
          <Grid.Col span={{ base: 12, md: 6 }}>
            {/* Hidden instead of unmounted during a stop, so that input is not lost. */}
            <Stack hidden={stop !== null} display={stop === null ? "flex" : "none"}>
              {work && station?.simulated && reads && operates && <work.FirstSteps patientId={patientId} />}
              <LeaseBar />
              {me && station && !worksAt(me, station.name) && (
                <Alert color="gray" variant="outline">
                  {t("station:station.notAssigned", { station: station.name })}
                </Alert>
              )}
              {reads &&
                (away ? (
                  <ReadySelect chosen={patientId} disabled={onApparatus !== undefined} onChange={choose} />
                ) : (
                  <PatientSelect
                    chosen={patient.data}
                    disabled={onApparatus !== undefined}
                    onChange={choose}
                  />
                ))}
              {patient.data && <Text>{patientWords(patient.data)}</Text>}
              {reads && !away && patientId && <Contraindications patientId={patientId} />}
              {!away && <ProblemNote error={patient.error} />}
              <ApparatusSideCard wanted={patient.data?.affected_side ?? kept?.side ?? undefined} />
              {/* A panel whose action is impossible now is replaced by the current activity. */}
              {work && operates && patientId && !run && (
                <work.TeachPanel key={`teach ${patientId}`} patientId={patientId} />
              )}
              {work && operates && patientId && !teaching && (
                <work.SessionWizard key={patientId} patientId={patientId} wanted={search.recording ?? null} />
              )}
              {work && !operates && run && (
                <Card withBorder component="section" aria-label={t("station:station.currentPlayback")}>
                  <work.Loaded run={run} />
                </Card>
              )}
            </Stack>
            {work && diagnoses && station?.simulated && (
              <Box mt={stop === null ? "md" : 0}>
                <work.SimulatorPanel />
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

/** Contraindications of the open episodes, shown before teaching and playback. */
function Contraindications({ patientId }: { patientId: string }) {
  const episodes = useEpisodes(patientId);
  const told = (episodes.data?.items ?? []).filter((one) => one.closed_at === null && one.contraindications);
  return told.map((one) => (
    <Alert
      key={one.id}
      color="gray"
      variant="outline"
      icon={<IconAlertTriangle />}
      title={t(`station:station.contraindications.${one.side}`)}
      data-testid="contraindications"
    >
      <Text fw={600} style={{ whiteSpace: "pre-wrap" }}>
        {one.contraindications}
      </Text>
    </Alert>
  ));
}

function patientWords({ affected_side, notes }: Patient): string {
  const shoulder = affected_side === null ? sideWord(null) : t(`station:station.shoulder.${affected_side}`);
  return notes ? t("station:station.shoulderNotes", { shoulder, notes }) : shoulder;
}
