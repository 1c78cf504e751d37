package example;

import java.io.IOException;
import java.net.Socket;
import java.net.URI;
import java.net.http.HttpClient;
import java.net.http.HttpRequest;
import java.net.http.HttpResponse;
import java.time.Duration;
import org.testcontainers.containers.GenericContainer;
import org.testcontainers.containers.wait.strategy.Wait;
import org.testcontainers.utility.DockerImageName;

/**
 * The emulator for tests: in a container of the image {@code ts3100} (or TS3100_IMAGE), or the one that
 * {@code ts3100 exec -- mvn test} has started around the tests, for machines without a container engine.
 */
final class RobotContainer implements AutoCloseable {
    private static final int IP0 = 1000;
    private static final int CONTROL = 3100;
    private static final Duration LONGEST_CALL = Duration.ofSeconds(60);

    private final HttpClient http = HttpClient.newHttpClient();
    private final GenericContainer<?> container;
    private final String host;
    private final int ip0;
    private final String control;

    RobotContainer() {
        if (System.getenv("TS3100_CONTROL_URL") != null) {
            container = null;
            host = System.getenv("TS3100_HOST");
            ip0 = Integer.parseInt(System.getenv("TS3100_IP0_PORT"));
            control = System.getenv("TS3100_CONTROL_URL");
            return;
        }
        String image = System.getenv().getOrDefault("TS3100_IMAGE", "ts3100");
        container = new GenericContainer<>(DockerImageName.parse(image))
                .withExposedPorts(IP0, 1001, 1002, CONTROL)
                // The network of the container is the test's own, so the control interface needs no token.
                .withEnv("TS3100_CONTROL_OPEN", "1")
                .waitingFor(Wait.forHttp("/health").forPort(CONTROL));
        container.start();
        host = container.getHost();
        ip0 = container.getMappedPort(IP0);
        control = "http://" + host + ":" + container.getMappedPort(CONTROL);
    }

    /** A connection to IP0, for your host program. */
    Socket connect() throws IOException {
        Socket socket = new Socket(host, ip0);
        // Without this, a second text waits up to 40 ms for the acknowledgement of the first.
        socket.setTcpNoDelay(true);
        socket.setSoTimeout(5000);
        return socket;
    }

    /** A call of the control interface; a refusal is an exception with the emulator's sentence. */
    String call(String method, String path, String json) throws IOException, InterruptedException {
        HttpRequest request = HttpRequest.newBuilder(URI.create(control + path))
                .timeout(LONGEST_CALL)
                .header("Content-Type", "application/json")
                .method(method, json == null ? HttpRequest.BodyPublishers.noBody() : HttpRequest.BodyPublishers.ofString(json))
                .build();
        HttpResponse<String> answer = http.send(request, HttpResponse.BodyHandlers.ofString());
        if (answer.statusCode() != 200) {
            throw new IOException(method + " " + path + ": " + answer.body());
        }
        return answer.body();
    }

    /** A fresh robot for the next test: as it was started, nobody connected, no findings. */
    void reset() throws IOException, InterruptedException {
        call("POST", "/reset", "{}");
    }

    /** The protocol mistakes of the host as JSON; {@code []} if it made none. */
    String findings() throws IOException, InterruptedException {
        return call("GET", "/findings", null);
    }

    @Override
    public void close() {
        if (container != null) {
            container.stop();
        }
    }
}
