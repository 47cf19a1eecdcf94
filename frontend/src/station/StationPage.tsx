import { Alert, Box, Card, Grid, Stack, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useNavigate, useSearch } from "@tanstack/react-router";
import { lazy, Suspense, useEffect } from "react";
import { useMay, useMe, useOperates, worksAt } from "../access/hooks";
import { api, type Patient } from "../api/client";
import { LiveApparatus } from "../apparatus3d/lazily";
import { useLive, useStation } from "../live/hooks";
import { PatientSelect } from "../patients/PatientSelect";
import { sideWord } from "../shared/format";
import { ProblemNote } from "../shared/problem";
import { StopBanner } from "../shared/StopBanner";
import { useTitle } from "../shared/title";
import { Angles } from "./Angles";
import { Lately } from "./Lately";
import { LeaseBar } from "./LeaseBar";
import { LoopHealth } from "./LoopHealth";
import { StandsFor } from "./StandsFor";
import { STATION } from "./words";

// The first page tells what the apparatus does, and stops it; what is worked with comes right behind.
const work = () => import("./work");
const FirstSteps = lazy(() => work().then(({ FirstSteps }) => ({ default: FirstSteps })));
const Loaded = lazy(() => work().then(({ Loaded }) => ({ default: Loaded })));
const SimulatorPanel = lazy(() => work().then(({ SimulatorPanel }) => ({ default: SimulatorPanel })));
const TeachPanel = lazy(() => work().then(({ TeachPanel }) => ({ default: TeachPanel })));
const Visit = lazy(() => work().then(({ Visit }) => ({ default: Visit })));

/** Where the therapist works: whom, teach, play, and what the arm does meanwhile. */
export function StationPage() {
  const station = useStation();
  const me = useMe();
  const reads = useMay("read_records");
  const operates = useOperates();
  const diagnoses = useMay("diagnose");
  const search = useSearch({ from: "/" });
  const run = useLive("run");
  const teaching = useLive("teaching");
  const stop = useLive("stop");
  const navigate = useNavigate({ from: "/" });
  useEffect(() => void work(), []);
  useTitle(station?.name ?? STATION.title);
  // Whoever is on the apparatus is the one this page is about.
  const onApparatus = run?.patient?.id ?? teaching?.patient?.id;
  const patientId = onApparatus ?? search.patient ?? null;
  const patient = useQuery({
    queryKey: ["patient", patientId],
    queryFn: () => api.patient(patientId ?? ""),
    enabled: reads && patientId !== null,
  });
  return (
    <Stack>
      <Title order={1} size="h2" style={{ position: "absolute", left: -9999 }}>
        {station?.name ?? STATION.title}
      </Title>
      <StopBanner whole />
      <Grid gap="lg">
        <Grid.Col span={{ base: 12, md: 6 }}>
          {/* Kept, so that nothing that was typed or chosen is lost over a stop. */}
          <Stack hidden={stop !== null} display={stop === null ? "flex" : "none"}>
            {station?.simulated && reads && operates && (
              <Suspense>
                <FirstSteps patientId={patientId} />
              </Suspense>
            )}
            <LeaseBar />
            {me && station && !worksAt(me, station.name) && (
              <Alert color="gray" variant="outline">
                {STATION.notHere(station.name)}
              </Alert>
            )}
            {reads && (
              <PatientSelect
                chosen={patient.data}
                disabled={onApparatus !== undefined}
                onChange={(chosen) => void navigate({ search: chosen ? { patient: chosen } : {} })}
              />
            )}
            {patient.data && <Text>{patientWords(patient.data)}</Text>}
            <ProblemNote error={patient.error} />
            <StandsFor wanted={patient.data?.affected_side ?? undefined} />
            <Suspense>
              {/* What cannot be done now gives its place to what is going on. */}
              {operates && patientId && !run && <TeachPanel patientId={patientId} />}
              {operates && patientId && !teaching && (
                <Visit key={patientId} patientId={patientId} wanted={search.recording ?? null} />
              )}
              {!operates && run && (
                <Card withBorder component="section" aria-label={STATION.goesOn}>
                  <Loaded run={run} />
                </Card>
              )}
            </Suspense>
          </Stack>
          {diagnoses && station?.simulated && (
            <Box mt={stop === null ? "md" : 0}>
              <Suspense>
                <SimulatorPanel />
              </Suspense>
            </Box>
          )}
        </Grid.Col>
        <Grid.Col span={{ base: 12, md: 6 }}>
          <Stack>
            <LiveApparatus />
            <Angles />
            <Lately />
            <LoopHealth />
          </Stack>
        </Grid.Col>
      </Grid>
    </Stack>
  );
}

function patientWords({ affected_side, notes }: Patient): string {
  const shoulder = affected_side === null ? sideWord(null) : STATION.shoulder(affected_side);
  return notes ? STATION.shoulderNotes(shoulder, notes) : shoulder;
}
