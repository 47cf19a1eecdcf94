import { speak } from "./shared/language";
import "@mantine/core/styles.css";
import "./page.css";
import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { RouterProvider } from "@tanstack/react-router";
import { setNonce } from "get-nonce";
import { StrictMode } from "react";
import { createRoot } from "react-dom/client";
import { Doing, keepGuard, minding } from "./access/guard";
import { access } from "./access/standing";
import { client } from "./api/client";
import { store } from "./live/store";
import { router } from "./router";
import { loadServerTexts } from "./shared/serverText";
import { scheme, theme, variables } from "./theme";

const queries = new QueryClient({ defaultOptions: { queries: { retry: 1, staleTime: 5_000 } } });
const nonce = document.querySelector<HTMLMetaElement>("meta[property=csp-nonce]")?.nonce ?? "";
const root = document.getElementById("root");
if (!root) throw new Error("index.html has no root");

const doing = new Doing();
client.use(minding(access, doing));
keepGuard(access, doing, queries, store, speak);
// Mantine's dialogs keep the page behind them from scrolling with a style element of their own.
setNonce(nonce);
const drawn = createRoot(root);
void loadServerTexts().then(() =>
  drawn.render(
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
