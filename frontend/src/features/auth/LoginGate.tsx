import { Text } from "@mantine/core";
import { Outlet, useRouterState } from "@tanstack/react-router";
import { lazy, type ReactNode, Suspense, useState } from "react";
import { t } from "../../lib/i18n";
import { RenderInSteps } from "../../ui/RenderInSteps";
import { LockedBrowser } from "../patient-mode/PatientMode";
import { AuthLayout } from "./AuthLayout";
import { authStore } from "./authState";
import { useAuthState } from "./hooks";
import { OPENID_PATH } from "./openId";
import { SignInPage } from "./SignInPage";

const EnrolPage = lazy(() => import("./AccountPage").then((page) => ({ default: page.EnrolPage })));

/** Pages that need no sign-in. */
const PUBLIC_PATHS = ["/sign-in", "/set-up", "/set-password"];

/**
 * Shows the page, the sign-in form or the lock screen, depending on the authentication state. The address does
 * not change, so the user returns to the same page. The hidden page is unmounted, and its data are fetched
 * again.
 */
export function LoginGate({ children }: { children: ReactNode }) {
  const auth = useAuthState();
  const [enrolling, setEnrolling] = useState<string | null>(null);
  const path = useRouterState({ select: (state) => state.location.pathname });
  // This page shows no records, and unlocks the screen of users with OpenID.
  if (path === OPENID_PATH) return <Outlet />;
  if (auth.is === "locked") return <LockedBrowser me={auth.me} />;
  if (PUBLIC_PATHS.includes(path)) return <Outlet />;
  if (auth.is === "unknown") return <Waiting />;
  if (auth.is === "out") return <SignInPage why={auth.why} />;
  // The page stays until the user has seen the recovery codes, which are shown only once.
  if (auth.me.enrolling && enrolling !== auth.me.account_id) setEnrolling(auth.me.account_id);
  if (enrolling === auth.me.account_id) {
    return (
      <Suspense>
        <EnrolPage me={auth.me} onDone={() => void authStore.refresh().then(() => setEnrolling(null))} />
      </Suspense>
    );
  }
  // Another time zone changes every shown day.
  return (
    <RenderInSteps key={auth.me.time_zone} meanwhile={<Waiting />}>
      {children}
    </RenderInSteps>
  );
}

function Waiting() {
  return (
    <AuthLayout title={t("auth:gate.checkingTitle")}>
      <Text role="status" data-testid="checking-login">
        {t("auth:gate.checking")}
      </Text>
    </AuthLayout>
  );
}
