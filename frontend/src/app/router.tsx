import { Box, Stack, Text, Title } from "@mantine/core";
import {
  createRootRoute,
  createRoute,
  createRouter,
  type ErrorComponentProps,
  lazyRouteComponent,
  redirect,
} from "@tanstack/react-router";
import { readAuditFilters } from "../features/administration/auditFilters";
import { LoginGate } from "../features/auth/LoginGate";
import { OPENID_PATH } from "../features/auth/openId";
import { readCommissioningSearch } from "../features/commissioning/commissioningTabs";
import { readPatientsSearch } from "../features/patients/patientsSearch";
import { readPatientTab } from "../features/patients/patientTabs";
import { readFilters } from "../features/sessions/sessionFilters";
import { readSessionView } from "../features/sessions/sessionTabs";
import { readSearch } from "../features/statistics/figuresSearch";
import { ProblemError } from "../lib/api/client";
import { t } from "../lib/i18n";
import { AppFrame } from "../safety/AppFrame";
import { InlineSlot } from "../ui/InlineSlot";
import { PageLink } from "../ui/links";
import { Shell } from "./Shell";

// The first bundle contains only the state bar and the sign-in pages. Every page loads on demand.
const rootRoute = createRootRoute({
  component: GatedShell,
  notFoundComponent: NotFound,
  errorComponent: ShellError,
});

/** Return the patient and the recording that the address of the station's page contains. */
const readStation = (search: Record<string, unknown>): { patient?: string; recording?: string } => ({
  ...(typeof search.patient === "string" && { patient: search.patient }),
  ...(typeof search.recording === "string" && { recording: search.recording }),
});

const homeRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/",
  component: lazyRouteComponent(() => import("../features/home/HomePage"), "HomePage"),
  validateSearch: (search): { whose?: "mine"; patient?: string; recording?: string } => ({
    ...(search.whose === "mine" && { whose: "mine" }),
    ...readStation(search),
  }),
  // The station's page had this address before, so old addresses are redirected.
  beforeLoad: ({ search: { patient, recording } }) => {
    if (patient || recording)
      throw redirect({
        to: "/station",
        search: { ...(patient && { patient }), ...(recording && { recording }) },
        replace: true,
      });
  },
});
const stationRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/station",
  component: lazyRouteComponent(() => import("../features/station/StationPage"), "StationPage"),
  // Start this import while the service is being asked who is signed in. The component that uses it reports a failed
  // import.
  loader: () => void import("../features/station/AxisSparkline").catch(() => undefined),
  validateSearch: readStation,
});
const figuresEntryRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/clinic",
  component: lazyRouteComponent(() => import("../features/statistics/FiguresPage"), "FiguresEntry"),
});
const figuresRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/clinic/$subject",
  component: lazyRouteComponent(() => import("../features/statistics/FiguresPage"), "FiguresPage"),
  validateSearch: readSearch,
});
const patientsRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/patients",
  component: lazyRouteComponent(() => import("../features/patients/PatientsPage"), "PatientsPage"),
  validateSearch: readPatientsSearch,
});
const patientRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/patients/$patientId",
  component: lazyRouteComponent(() => import("../features/patients/PatientPage"), "PatientPage"),
  validateSearch: readPatientTab,
});
const recordingRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/recordings/$recordingId",
  component: lazyRouteComponent(() => import("../features/recordings/RecordingPage"), "RecordingPage"),
});
const sessionsRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/sessions",
  component: lazyRouteComponent(() => import("../features/sessions/SessionsPage"), "SessionsPage"),
  validateSearch: readFilters,
});
const sessionRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/sessions/$sessionId",
  component: lazyRouteComponent(() => import("../features/sessions/SessionPage"), "SessionPage"),
  validateSearch: readSessionView,
});

const progressRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/episodes/$episodeId/progress",
  component: lazyRouteComponent(() => import("../features/progress/ProgressPage"), "ProgressPage"),
});

const programmeRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/programmes/$programmeId",
  component: lazyRouteComponent(() => import("../features/programmes/ProgrammePage"), "ProgrammePage"),
});
const newProgrammeRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/patients/$patientId/programmes/new",
  component: lazyRouteComponent(() => import("../features/programmes/NewProgrammePage"), "NewProgrammePage"),
});

const accountRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/account",
  component: lazyRouteComponent(() => import("../features/auth/AccountPage"), "AccountPage"),
});
// Pages before sign-in. The links of the demonstration clinic lead to /sign-in.
const signInRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/sign-in",
  component: lazyRouteComponent(() => import("../features/auth/LinkPage"), "LinkPage"),
});
const setUpRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/set-up",
  component: lazyRouteComponent(() => import("../features/auth/SetPasswordPage"), "SetUpPage"),
});
const openIdRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: OPENID_PATH,
  component: lazyRouteComponent(() => import("../features/auth/OpenIdPage"), "OpenIdPage"),
});
const setPasswordRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/set-password",
  component: lazyRouteComponent(() => import("../features/auth/SetPasswordPage"), "SetPasswordPage"),
});

const stationsRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/stations",
  component: lazyRouteComponent(() => import("../features/fleet/StationsPage"), "StationsPage"),
});

const commissioningRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/commissioning",
  component: lazyRouteComponent(
    () => import("../features/commissioning/CommissioningPage"),
    "CommissioningPage",
  ),
  validateSearch: readCommissioningSearch,
});

const administrationRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/administration",
  component: lazyRouteComponent(
    () => import("../features/administration/AdministrationPage"),
    "AdministrationPage",
  ),
});
const administrationIndexRoute = createRoute({
  getParentRoute: () => administrationRoute,
  path: "/",
  beforeLoad: () => {
    throw redirect({ to: "/administration/accounts" });
  },
});
const accountsRoute = createRoute({
  getParentRoute: () => administrationRoute,
  path: "/accounts",
  component: lazyRouteComponent(() => import("../features/administration/AccountsPage"), "AccountsPage"),
});
const auditRoute = createRoute({
  getParentRoute: () => administrationRoute,
  path: "/audit",
  component: lazyRouteComponent(() => import("../features/administration/AuditPage"), "AuditPage"),
  validateSearch: readAuditFilters,
});
const breakGlassAccessesRoute = createRoute({
  getParentRoute: () => administrationRoute,
  path: "/emergency-access",
  component: lazyRouteComponent(
    () => import("../features/administration/BreakGlassAccessesPage"),
    "BreakGlassAccessesPage",
  ),
});

const clinicRoute = createRoute({
  getParentRoute: () => administrationRoute,
  path: "/clinic",
  component: lazyRouteComponent(() => import("../features/administration/ClinicPage"), "ClinicPage"),
});
const backupsRoute = createRoute({
  getParentRoute: () => administrationRoute,
  path: "/backups",
  component: lazyRouteComponent(() => import("../features/administration/BackupsPage"), "BackupsPage"),
});

// The components and their rules, for developers of the page.
const designRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/design",
  component: lazyRouteComponent(() => import("../features/design/DesignPage"), "DesignPage"),
});

export const router = createRouter({
  routeTree: rootRoute.addChildren([
    homeRoute,
    stationRoute,
    figuresEntryRoute,
    figuresRoute,
    stationsRoute,
    commissioningRoute,
    patientsRoute,
    patientRoute,
    recordingRoute,
    sessionsRoute,
    sessionRoute,
    progressRoute,
    programmeRoute,
    newProgrammeRoute,
    ...(import.meta.env.DEV ? [designRoute] : []),
    accountRoute,
    signInRoute,
    openIdRoute,
    setUpRoute,
    setPasswordRoute,
    administrationRoute.addChildren([
      administrationIndexRoute,
      accountsRoute,
      auditRoute,
      breakGlassAccessesRoute,
      backupsRoute,
      clinicRoute,
    ]),
  ]),
  defaultNotFoundComponent: NotFound,
  // A page that fails leaves the shell with Stop in place.
  defaultErrorComponent: PageError,
  // Load a page as soon as its link is hovered or touched.
  defaultPreload: "intent",
});

declare module "@tanstack/react-router" {
  interface Register {
    router: typeof router;
  }
}

/** Every page, behind the authentication gate. */
function GatedShell() {
  return (
    <LoginGate>
      <Shell />
    </LoginGate>
  );
}

function NotFound() {
  return (
    <Stack>
      <Title order={1} size="h2">
        {t("app:noPage.title")}
      </Title>
      <Text>
        <InlineSlot words={(link) => t("app:noPage.old", { link })}>
          <PageLink to="/">{t("app:noPage.toHome")}</PageLink>
        </InlineSlot>
      </Text>
    </Stack>
  );
}

/** Shown in place of a shell that failed: Stop and the apparatus' state stay. */
function ShellError(props: ErrorComponentProps) {
  return (
    <AppFrame>
      <Box p="md">
        <PageError {...props} />
      </Box>
    </AppFrame>
  );
}

/** Replaces a page that fails. Stop and the state bar are outside the page and keep working. */
function PageError({ error }: ErrorComponentProps) {
  return (
    <Stack role="alert">
      <Title order={1} size="h2">
        {t("app:noPage.broken")}
      </Title>
      <Text>
        {error instanceof ProblemError ? `${error.message} ${error.nextStep}` : t("app:noPage.brokenHint")}
      </Text>
    </Stack>
  );
}
