// Package cell tests a host program against the emulator: in a container of the image ts3100 (or TS3100_IMAGE), or the
// one that `ts3100 exec -- go test` has started around the tests, for machines without a container engine.
package cell

import (
	"bufio"
	"bytes"
	"context"
	"encoding/json"
	"fmt"
	"io"
	"net"
	"net/http"
	"os"
	"strings"
	"testing"
	"time"

	"github.com/testcontainers/testcontainers-go"
	"github.com/testcontainers/testcontainers-go/wait"
)

const (
	ip0Port     = "1000/tcp"
	controlPort = "3100/tcp"
	// The manual asks for 50 ms between an answer and the next command.
	pause   = 51 * time.Millisecond
	timeout = 5 * time.Second
)

var robot struct{ ip0, control string }

func TestMain(m *testing.M) {
	stop, err := start(context.Background())
	if err != nil {
		fmt.Fprintln(os.Stderr, "cannot start the robot:", err)
		os.Exit(1)
	}
	code := m.Run()
	stop()
	os.Exit(code)
}

func start(ctx context.Context) (stop func(), err error) {
	if robot.control = os.Getenv("TS3100_CONTROL_URL"); robot.control != "" {
		robot.ip0 = os.Getenv("TS3100_IP0")
		return func() {}, nil
	}
	image := os.Getenv("TS3100_IMAGE")
	if image == "" {
		image = "ts3100"
	}
	container, err := testcontainers.GenericContainer(ctx, testcontainers.GenericContainerRequest{
		ContainerRequest: testcontainers.ContainerRequest{
			Image:        image,
			ExposedPorts: []string{ip0Port, "1001/tcp", "1002/tcp", controlPort},
			// The network of the container is the test's own, so the control interface needs no token.
			Env:        map[string]string{"TS3100_CONTROL_OPEN": "1"},
			WaitingFor: wait.ForHTTP("/health").WithPort(controlPort),
		},
		Started: true,
	})
	if err != nil {
		return nil, err
	}
	stop = func() { _ = testcontainers.TerminateContainer(container) }
	if robot.ip0, err = container.PortEndpoint(ctx, ip0Port, ""); err != nil {
		stop()
		return nil, err
	}
	if robot.control, err = container.PortEndpoint(ctx, controlPort, "http"); err != nil {
		stop()
		return nil, err
	}
	return stop, nil
}

// call makes a call of the control interface and returns its answer.
func call(t *testing.T, method, path string, body any) []byte {
	t.Helper()
	var content io.Reader
	if body != nil {
		text, err := json.Marshal(body)
		if err != nil {
			t.Fatal(err)
		}
		content = bytes.NewReader(text)
	}
	request, err := http.NewRequestWithContext(t.Context(), method, robot.control+path, content)
	if err != nil {
		t.Fatal(err)
	}
	request.Header.Set("Content-Type", "application/json")
	answer, err := http.DefaultClient.Do(request)
	if err != nil {
		t.Fatal(err)
	}
	defer answer.Body.Close()
	result, err := io.ReadAll(answer.Body)
	if err != nil {
		t.Fatal(err)
	}
	if answer.StatusCode != http.StatusOK {
		t.Fatalf("%s %s: %s", method, path, result)
	}
	return result
}

type fields map[string]any

// host is your host program: here it sends commands and returns the answers.
func host(t *testing.T, commands ...string) []string {
	t.Helper()
	connection, err := net.DialTimeout("tcp", robot.ip0, timeout)
	if err != nil {
		t.Fatal(err)
	}
	defer connection.Close()
	var answers []string
	reader := bufio.NewReader(connection)
	for _, command := range commands {
		if err := connection.SetDeadline(time.Now().Add(timeout)); err != nil {
			t.Fatal(err)
		}
		fmt.Fprintf(connection, "\x02%s\r\x03", command)
		answer, err := reader.ReadString('\x03')
		if err != nil {
			t.Fatal(err)
		}
		answers = append(answers, strings.Trim(answer, "\x02\r\x03"))
		time.Sleep(pause)
	}
	return answers
}

func TestTheRobotPlacesAPart(t *testing.T) {
	call(t, "POST", "/reset", fields{})
	call(t, "PUT", "/clock", fields{"mode": "stepped"})
	call(t, "PUT", "/files/PICK", fields{"text": "PROGRAM PICK\nWAIT DIN(1)\nDELAY 2\nDOUT(5)\nEND\n"})
	if answers := fmt.Sprint(host(t, "SO", "SL,PICK", "RN")); answers != "[OK OK OK]" {
		t.Fatal(answers)
	}
	call(t, "PUT", "/inputs/1", fields{"on": true})
	waited := call(t, "POST", "/clock/advance-until", fields{"condition": "output 5 on", "within": 10})
	if !bytes.Contains(waited, []byte(`"reached":true`)) {
		t.Errorf("the part was not placed: %s", waited)
	}
	if findings := call(t, "GET", "/findings", nil); string(findings) != "[]" {
		t.Errorf("protocol mistakes of the host: %s", findings)
	}
}

func TestTheEmergencyStopRefusesAStart(t *testing.T) {
	call(t, "POST", "/reset", fields{})
	call(t, "PUT", "/emergency-stop", fields{"pressed": true})
	if answers := fmt.Sprint(host(t, "SO")); answers != "[NG]" {
		t.Error(answers)
	}
}

func TestAWrongHostIsNamed(t *testing.T) {
	call(t, "POST", "/reset", fields{})
	host(t, "XX")
	if findings := call(t, "GET", "/findings", nil); !bytes.Contains(findings, []byte(`"rule":"unknown-command"`)) {
		t.Errorf("no finding: %s", findings)
	}
}
