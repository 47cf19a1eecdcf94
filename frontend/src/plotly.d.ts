declare module "plotly.js-cartesian-dist-min" {
  const Plotly: {
    react(
      element: HTMLElement,
      data: unknown[],
      layout: Record<string, unknown>,
      config: Record<string, unknown>,
    ): Promise<void>;
    purge(element: HTMLElement): void;
  };
  export default Plotly;
}
