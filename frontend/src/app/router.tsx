import { Stack, Text, Title } from "@mantine/core";
import {
  createRootRoute,
  createRoute,
  createRouter,
  type ErrorComponentProps,
  lazyRouteComponent,
  redirect,
} from "@tanstack/react-router";
import { readAuditFilters } from "../features/administration/auditFilters";
import { Gate } from "../features/auth/Gate";
import { LinkPage } from "../features/auth/LinkPage";
import { OpenIdPage } from "../features/auth/OpenIdPage";
import { OPENID_PATH } from "../features/auth/openId";
import { readFilters } from "../features/sessions/sessionFilters";
import { StationPage } from "../features/station/StationPage";
import { ProblemError } from "../lib/api/client";
import { InlineSlot } from "../ui/InlineSlot";
import { PageLink } from "../ui/links";
import { NO_PAGE } from "./messages";
import { Shell } from "./Shell";

// Only the station's page, the state bar and the door come at once; every other page is fetched when it is needed.
const root = createRootRoute({ component: Page, notFoundComponent: NotFound, errorComponent: Broken });

const station = createRoute({
  getParentRoute: () => root,
  path: "/",
  component: StationPage,
  // On their way while the service is still asked who is signed in; whoever needs them hears of it when one does not come.
  loader: () =>
    void Promise.allSettled([
      import("../features/station/lazyStationPanels"),
      import("../features/station/AxisSparkline"),
    ]),
  validateSearch: (search): { patient?: string; recording?: string } => ({
    ...(typeof search.patient === "string" && { patient: search.patient }),
    ...(typeof search.recording === "string" && { recording: search.recording }),
  }),
});
const patients = createRoute({
  getParentRoute: () => root,
  path: "/patients",
  component: lazyRouteComponent(() => import("../features/patients/PatientsPage"), "PatientsPage"),
});
const patient = createRoute({
  getParentRoute: () => root,
  path: "/patients/$patientId",
  component: lazyRouteComponent(() => import("../features/patients/PatientPage"), "PatientPage"),
});
const recording = createRoute({
  getParentRoute: () => root,
  path: "/recordings/$recordingId",
  component: lazyRouteComponent(() => import("../features/recordings/RecordingPage"), "RecordingPage"),
});
const sessions = createRoute({
  getParentRoute: () => root,
  path: "/sessions",
  component: lazyRouteComponent(() => import("../features/sessions/SessionsPage"), "SessionsPage"),
  validateSearch: readFilters,
});
const session = createRoute({
  getParentRoute: () => root,
  path: "/sessions/$sessionId",
  component: lazyRouteComponent(() => import("../features/sessions/SessionPage"), "SessionPage"),
});

const progress = createRoute({
  getParentRoute: () => root,
  path: "/episodes/$episodeId/progress",
  component: lazyRouteComponent(() => import("../features/progress/ProgressPage"), "ProgressPage"),
  validateSearch: (search): { patient?: string } => ({
    ...(typeof search.patient === "string" && { patient: search.patient }),
  }),
});

const programme = createRoute({
  getParentRoute: () => root,
  path: "/programmes/$programmeId",
  component: lazyRouteComponent(() => import("../features/programmes/ProgrammePage"), "ProgrammePage"),
});
const newProgramme = createRoute({
  getParentRoute: () => root,
  path: "/patients/$patientId/programmes/new",
  component: lazyRouteComponent(() => import("../features/programmes/NewProgrammePage"), "NewProgrammePage"),
});

const account = createRoute({
  getParentRoute: () => root,
  path: "/account",
  component: lazyRouteComponent(() => import("../features/auth/AccountPage"), "AccountPage"),
});
// For whoever cannot sign in yet; the links of the demonstration clinic lead to /sign-in.
const signIn = createRoute({ getParentRoute: () => root, path: "/sign-in", component: LinkPage });
const setUp = createRoute({
  getParentRoute: () => root,
  path: "/set-up",
  component: lazyRouteComponent(() => import("../features/auth/SetPasswordPage"), "SetUpPage"),
});
const openId = createRoute({ getParentRoute: () => root, path: OPENID_PATH, component: OpenIdPage });
const setPassword = createRoute({
  getParentRoute: () => root,
  path: "/set-password",
  component: lazyRouteComponent(() => import("../features/auth/SetPasswordPage"), "SetPasswordPage"),
});

const stations = createRoute({
  getParentRoute: () => root,
  path: "/stations",
  component: lazyRouteComponent(() => import("../features/fleet/StationsPage"), "StationsPage"),
});

const administration = createRoute({
  getParentRoute: () => root,
  path: "/administration",
  component: lazyRouteComponent(
    () => import("../features/administration/AdministrationPage"),
    "AdministrationPage",
  ),
});
const firstOfAdministration = createRoute({
  getParentRoute: () => administration,
  path: "/",
  beforeLoad: () => {
    throw redirect({ to: "/administration/accounts" });
  },
});
const accounts = createRoute({
  getParentRoute: () => administration,
  path: "/accounts",
  component: lazyRouteComponent(() => import("../features/administration/AccountsPage"), "AccountsPage"),
});
const audit = createRoute({
  getParentRoute: () => administration,
  path: "/audit",
  component: lazyRouteComponent(() => import("../features/administration/AuditPage"), "AuditPage"),
  validateSearch: readAuditFilters,
});
const emergencyAccess = createRoute({
  getParentRoute: () => administration,
  path: "/emergency-access",
  component: lazyRouteComponent(
    () => import("../features/administration/EmergencyAccessPage"),
    "EmergencyAccessPage",
  ),
});

const backups = createRoute({
  getParentRoute: () => administration,
  path: "/backups",
  component: lazyRouteComponent(() => import("../features/administration/BackupsPage"), "BackupsPage"),
});

export const router = createRouter({
  routeTree: root.addChildren([
    station,
    stations,
    patients,
    patient,
    recording,
    sessions,
    session,
    progress,
    programme,
    newProgramme,
    account,
    signIn,
    openId,
    setUp,
    setPassword,
    administration.addChildren([firstOfAdministration, accounts, audit, emergencyAccess, backups]),
  ]),
  defaultNotFoundComponent: NotFound,
  // A page is on its way before somebody has pressed its link.
  defaultPreload: "intent",
});

declare module "@tanstack/react-router" {
  interface Register {
    router: typeof router;
  }
}

/** Every page, for whoever is let in. */
function Page() {
  return (
    <Gate>
      <Shell />
    </Gate>
  );
}

function NotFound() {
  return (
    <Stack>
      <Title order={1} size="h2">
        {NO_PAGE.none}
      </Title>
      <Text>
        <InlineSlot words={NO_PAGE.old}>
          <PageLink to="/">{NO_PAGE.toStation}</PageLink>
        </InlineSlot>
      </Text>
    </Stack>
  );
}

/** A page that fails takes neither Stop nor the state of the apparatus with it: those stand outside. */
function Broken({ error }: ErrorComponentProps) {
  return (
    <Stack role="alert">
      <Title order={1} size="h2">
        {NO_PAGE.broken}
      </Title>
      <Text>{error instanceof ProblemError ? `${error.message} ${error.nextStep}` : NO_PAGE.wrong}</Text>
    </Stack>
  );
}
