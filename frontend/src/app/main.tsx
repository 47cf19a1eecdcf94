import { switchLanguage } from "../lib/language";
import "./mantine.css";
import "./page.css";
import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { RouterProvider } from "@tanstack/react-router";
import { setNonce } from "get-nonce";
import { StrictMode } from "react";
import { createRoot } from "react-dom/client";
import { authStore } from "../features/auth/authState";
import { ActivityTracker, authMiddleware, startSessionGuard } from "../features/auth/sessionGuard";
import { client } from "../lib/api/client";
import { store } from "../lib/live/store";
import { loadServerTexts } from "../lib/serverText";
import { startPrintScheme } from "./printScheme";
import { router } from "./router";
import { scheme, theme, variables } from "./theme";

const queries = new QueryClient({ defaultOptions: { queries: { retry: 1, staleTime: 5_000 } } });
const nonce = document.querySelector<HTMLMetaElement>("meta[property=csp-nonce]")?.nonce ?? "";
const root = document.getElementById("root");
if (!root) throw new Error("index.html has no root");

const activity = new ActivityTracker();
client.use(authMiddleware(authStore, activity));
router.subscribe("onBeforeNavigate", activity.open);
startSessionGuard(authStore, activity, queries, store, switchLanguage);
// Mantine's dialogs add a style element that stops the page behind them from scrolling. The element needs the CSP
// nonce.
setNonce(nonce);
startPrintScheme();
const reactRoot = createRoot(root);
void loadServerTexts().then(() =>
  reactRoot.render(
    <StrictMode>
      <MantineProvider
        theme={theme}
        cssVariablesResolver={variables}
        colorSchemeManager={scheme}
        defaultColorScheme="auto"
        getStyleNonce={() => nonce}
      >
        <QueryClientProvider client={queries}>
          <RouterProvider router={router} />
        </QueryClientProvider>
      </MantineProvider>
    </StrictMode>,
  ),
);
