import { MantineProvider } from "@mantine/core";
import { act, cleanup, render, screen, waitFor } from "@testing-library/react";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { Plot } from "./Plot";
import plotly, { listeners, plot } from "./testPlotly";

// Other files draw, too.
beforeEach(() => {
  plotly.react.mockClear();
  plotly.purge.mockClear();
});
afterEach(cleanup);

const figure = (name: string) => ({ data: [{ name }], layout: { height: 300 }, texts: [] });

test("a zoom requests a window and redraws in place", async () => {
  const onWindow = vi.fn();
  const page = (shownFigure: ReturnType<typeof figure>) => (
    <MantineProvider>
      <Plot figure={shownFigure} label="Motor 1" onWindow={onWindow} />
    </MantineProvider>
  );
  const wholeFigure = figure("an hour");
  const { rerender, unmount } = render(page(wholeFigure));
  await waitFor(() => expect(plotly.react).toHaveBeenCalledTimes(1));
  expect(wholeFigure.layout).toEqual({ height: 300 });
  await waitFor(() => expect(listeners.plotly_relayout).toBeDefined());

  act(() => listeners.plotly_relayout?.({ "xaxis.range[0]": 10, "xaxis.range[1]": 20 }));
  expect(onWindow).toHaveBeenLastCalledWith({ start_s: 10, end_s: 20 });
  act(() => listeners.plotly_relayout?.({ "yaxis.range[0]": 10, "yaxis.range[1]": 20 }));
  expect(onWindow).toHaveBeenCalledTimes(1);

  rerender(page(figure("ten seconds")));
  await waitFor(() => expect(plotly.react).toHaveBeenCalledTimes(2));
  expect(plotly.purge).not.toHaveBeenCalled();
  act(() => listeners.plotly_relayout?.({ "xaxis.autorange": true }));
  expect(onWindow).toHaveBeenLastCalledWith(null);

  unmount();
  expect(plotly.purge).toHaveBeenCalledTimes(1);
});

test("has the colour of the page, prints in light colours on a sheet and keeps the zoom", async () => {
  document.body.style.backgroundColor = "rgb(36, 36, 36)";
  const drawn = {
    data: [],
    layout: { height: 300, paper_bgcolor: "white", xaxis: { title: "Time" } },
    texts: [],
  };
  const { unmount } = render(
    <MantineProvider forceColorScheme="dark">
      <Plot figure={drawn} label="Motor 1" />
    </MantineProvider>,
  );
  await waitFor(() => expect(screen.getByRole("figure").dataset.drawn).toBe("true"));
  const layout = () => plotly.react.mock.lastCall?.[2];
  expect(layout()).toMatchObject({ paper_bgcolor: "rgb(36, 36, 36)" });
  vi.spyOn(HTMLElement.prototype, "clientWidth", "get").mockReturnValue(1200);
  plot.layout = { xaxis: { range: [10, 20], autorange: false } };

  window.dispatchEvent(new Event("beforeprint"));
  expect(layout()).toMatchObject({
    paper_bgcolor: "white",
    width: 640,
    xaxis: { title: "Time", range: [10, 20], autorange: false },
  });
  window.dispatchEvent(new Event("afterprint"));
  expect(layout()).toMatchObject({ paper_bgcolor: "rgb(36, 36, 36)", xaxis: { range: [10, 20] } });
  expect(layout()).not.toHaveProperty("width");

  unmount();
  const before = plotly.react.mock.calls.length;
  window.dispatchEvent(new Event("beforeprint"));
  expect(plotly.react).toHaveBeenCalledTimes(before);
});
