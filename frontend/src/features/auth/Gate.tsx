import { Text } from "@mantine/core";
import { Outlet, useRouterState } from "@tanstack/react-router";
import { lazy, type ReactNode, Suspense, useDeferredValue, useState } from "react";
import { AuthLayout } from "./AuthLayout";
import { DOOR } from "./authLayoutMessages";
import { authStore } from "./authState";
import { useStanding } from "./hooks";
import { LockScreen } from "./LockScreen";
import { OPENID_PATH } from "./openId";
import { SignInPage } from "./SignInPage";

const EnrolPage = lazy(() => import("./AccountPage").then((page) => ({ default: page.EnrolPage })));

/** Pages for somebody who cannot sign in yet. */
const BEFORE = ["/sign-in", "/set-up", "/set-password"];

/**
 * What is shown depends on who is there. The address stays, so that after signing in or unlocking one is where one was; what
 * it shows is taken away whole, and fetched anew.
 */
export function Gate({ children }: { children: ReactNode }) {
  const standing = useStanding();
  const [enrolling, setEnrolling] = useState<string | null>(null);
  const path = useRouterState({ select: (state) => state.location.pathname });
  // Shows nothing of anybody, and is how some unlock the screen.
  if (path === OPENID_PATH) return <Outlet />;
  if (standing.is === "locked") return <LockScreen me={standing.me} />;
  if (BEFORE.includes(path)) return <Outlet />;
  if (standing.is === "unknown") return <OneMoment />;
  if (standing.is === "out") return <SignInPage why={standing.why} />;
  // Until they have seen their recovery codes, which are shown only once.
  if (standing.me.enrolling && enrolling !== standing.me.account_id) setEnrolling(standing.me.account_id);
  if (enrolling === standing.me.account_id) {
    return (
      <Suspense>
        <EnrolPage me={standing.me} onDone={() => void authStore.look().then(() => setEnrolling(null))} />
      </Suspense>
    );
  }
  return <Within>{children}</Within>;
}

/** In slices: all of a page at once is a quarter of a second in which a slow tablet hears no finger. */
function Within({ children }: { children: ReactNode }) {
  return useDeferredValue(true, false) ? children : <OneMoment />;
}

function OneMoment() {
  return (
    <AuthLayout title={DOOR.oneMoment}>
      <Text role="status">{DOOR.asking}</Text>
    </AuthLayout>
  );
}
