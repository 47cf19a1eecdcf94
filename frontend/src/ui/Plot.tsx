import { Button, Group, Skeleton, Text, useComputedColorScheme } from "@mantine/core";
import { useEffect, useRef, useState } from "react";
import type { Schemas } from "../lib/api/client";
import { t } from "../lib/i18n";
import { LANGUAGE } from "../lib/language";
import { translatePlaced } from "../lib/serverText";
import { whenIdle } from "../lib/whenIdle";
import { keepZoom, recolour, toPaper } from "./plotColours";
import { enlarged, fitTexts, textScale } from "./plotTexts";
import { type PlotWindow, toWindow } from "./plotWindow";

// Options of Plotly. A double click shows the whole figure.
const config = {
  responsive: true,
  locale: LANGUAGE,
  displaylogo: false,
  doubleClick: "autosize",
  modeBarButtonsToRemove: ["resetScale2d"],
};

type Figure = Schemas["Figure"];
type OnWindow = ((window: PlotWindow | null) => void) | undefined;

/**
 * Return a ref whose function is called before (true) and after (false) the page is printed. The browser prints
 * as soon as it returns.
 */
function usePrinting() {
  const print = useRef<(onPaper: boolean) => void>(() => {});
  useEffect(() => {
    const before = () => print.current(true);
    const after = () => print.current(false);
    window.addEventListener("beforeprint", before);
    window.addEventListener("afterprint", after);
    return () => {
      window.removeEventListener("beforeprint", before);
      window.removeEventListener("afterprint", after);
    };
  }, []);
  return print;
}

/** A page that is never idle, as on a slow computer, still gets its figures. */
const LONGEST_WAIT_MS = 1000;

/** Resolve when the browser is idle. */
const idle = () => new Promise<void>((resolve) => void whenIdle(resolve, LONGEST_WAIT_MS));

/** Return the colour of the card, or else of the page, that contains the figure. */
const backgroundOf = (element: HTMLElement) =>
  getComputedStyle(element.closest(".mantine-Card-root") ?? document.body).backgroundColor || undefined;

/** Draw the figure into `elementRef`. Draw again for each new figure or colour scheme, and for `retry`. */
function usePlotly(figure: Figure, onWindow: OnWindow) {
  const elementRef = useRef<HTMLElement>(null);
  const [drawn, setDrawn] = useState(false);
  const [failed, setFailed] = useState(false);
  const [attempt, setAttempt] = useState(0);
  const onWindowRef = useRef(onWindow);
  onWindowRef.current = onWindow;
  const cleanup = useRef(() => {});
  const print = usePrinting();
  const scheme = useComputedColorScheme();
  // biome-ignore lint/correctness/useExhaustiveDependencies: `retry` must draw again
  useEffect(() => {
    const element = elementRef.current;
    if (!element) return;
    let cancelled = false;
    const draw = async () => {
      // Plotly takes more than 0.1 s each to start and to draw. The page is painted before, and answers between both.
      await idle();
      if (cancelled) return;
      const { default: Plotly } = await import("plotly.js-basic-dist-min");
      if (LANGUAGE === "ja") {
        const { default: words } = await import("../locales/ja/plotly.json");
        Plotly.register({ moduleType: "locale", name: LANGUAGE, ...words });
      }
      await idle();
      if (cancelled) return;
      // Copied, because Plotly modifies the layout that it gets.
      const scale = textScale();
      const translated = fitTexts(translatePlaced(figure), element.clientWidth / scale);
      const coloured = () => recolour(enlarged(translated, scale), scheme, backgroundOf(element));
      const { data, layout } = coloured();
      const plot = await Plotly.react(element, data, layout, config);
      print.current = (onPaper) => {
        const next = onPaper ? toPaper(translated, element.clientWidth) : coloured();
        keepZoom(plot.layout, next.layout);
        void Plotly.react(element, next.data, next.layout, config);
      };
      plot.removeAllListeners("plotly_relayout");
      plot.on("plotly_relayout", (change) => {
        const window = toWindow(change);
        if (window !== undefined) onWindowRef.current?.(window);
      });
      cleanup.current = () => {
        print.current = () => {};
        Plotly.purge(element);
      };
      setFailed(false);
      setDrawn(true);
    };
    draw().catch(() => {
      if (!cancelled) setFailed(true);
    });
    return () => {
      cancelled = true;
    };
  }, [figure, scheme, attempt, print]);
  useEffect(() => () => cleanup.current(), []);
  return { elementRef, drawn, failed, retry: () => setAttempt(attempt + 1) };
}

/**
 * A Plotly figure from the service. Plotly is large and loads on first use.
 *
 * The service reduces a long motion to what a screen can show. `onWindow` receives the zoomed part, to
 * request its details.
 */
export function Plot({ figure, label, onWindow }: { figure: Figure; label: string; onWindow?: OnWindow }) {
  const { elementRef, drawn, failed, retry } = usePlotly(figure, onWindow);
  const height = typeof figure.layout.height === "number" ? figure.layout.height : 340;
  return (
    <div style={{ position: "relative", minHeight: height * textScale() }}>
      {failed && (
        <Group role="alert">
          <Text>{t("ui:figure.failed")}</Text>
          <Button variant="default" onClick={retry}>
            {t("ui:figure.retry")}
          </Button>
        </Group>
      )}
      {!drawn && !failed && (
        <Skeleton pos="absolute" inset={0} role="status" aria-label={t("ui:figure.drawing")} />
      )}
      <figure ref={elementRef} aria-label={label} data-drawn={drawn} style={{ margin: 0 }} />
    </div>
  );
}
