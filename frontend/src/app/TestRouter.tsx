import {
  createMemoryHistory,
  createRootRoute,
  createRouter,
  RouterContextProvider,
  type RouterHistory,
} from "@tanstack/react-router";
import { type ReactNode, useState } from "react";

/** Gives the links of a test their addresses, in place of the page's router. */
export function TestRouter({ children, history }: { children: ReactNode; history?: RouterHistory }) {
  const [router] = useState(() =>
    createRouter({ routeTree: createRootRoute(), history: history ?? createMemoryHistory() }),
  );
  return <RouterContextProvider router={router}>{children}</RouterContextProvider>;
}
