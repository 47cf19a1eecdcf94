import { Text } from "@mantine/core";
import { Outlet, useRouterState } from "@tanstack/react-router";
import { lazy, type ReactNode, Suspense } from "react";
import { Door } from "./Door";
import { useStanding } from "./hooks";
import { LockScreen } from "./LockScreen";
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
  const path = useRouterState({ select: (state) => state.location.pathname });
  if (standing.is === "locked") return <LockScreen me={standing.me} />;
  if (BEFORE.includes(path)) return <Outlet />;
  if (standing.is === "unknown") {
    return (
      <Door title="One moment">
        <Text role="status">The page asks the service who is signed in here.</Text>
      </Door>
    );
  }
  if (standing.is === "out") return <SignInPage why={standing.why} />;
  if (standing.me.enrolling) {
    return (
      <Suspense>
        <EnrolPage me={standing.me} />
      </Suspense>
    );
  }
  return children;
}
